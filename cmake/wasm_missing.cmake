# wasm_missing(NAME): sets NAME to a sentence on what the WebAssembly toolchain lacks; empty: nothing.
function(wasm_missing name)
  set(missing "")
  foreach(file bin/clang-14 bin/clang++-14 bin/wasm-ld-14 bin/llvm-ar-14 include/wasm32-wasi/stdio.h
      lib/wasm32-wasi/libc++.a lib/wasm32-wasi/libc++abi.a
      lib/llvm-14/lib/clang/14.0.6/lib/wasi/libclang_rt.builtins-wasm32.a)
    if(NOT EXISTS /usr/${file})
      string(APPEND missing " /usr/${file}")
    endif()
  endforeach()
  if(missing)
    string(PREPEND missing "the page's WebAssembly cannot be built without")
    string(APPEND missing "; apt-get install clang-14 lld-14 llvm-14 wasi-libc libclang-rt-14-dev-wasm32 "
      "libc++-14-dev-wasm32 libc++abi-14-dev-wasm32, or configure with -DFINGERTIP_WEB=OFF")
  endif()
  set(${name} "${missing}" PARENT_SCOPE)
endfunction()
