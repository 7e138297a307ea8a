# The warnings that every target of ours is built with, as errors.
add_library(ft_warnings INTERFACE)
target_compile_options(ft_warnings INTERFACE
  -Wall -Wextra -Werror -Wconversion -Wshadow -Wundef -Wdouble-promotion -Wcast-align -Wvla
  -Wwrite-strings -Wnull-dereference
  $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes -Wold-style-definition>
)

# Code generation that the results depend on: without contraction to fused multiply-adds, every
# machine computes the same bits.
add_library(ft_codegen INTERFACE)
target_compile_options(ft_codegen INTERFACE -ffp-contract=off -fno-math-errno)

if(FINGERTIP_SANITIZE)
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()
if(FINGERTIP_LIBFUZZER)
  add_compile_options(-fsanitize=fuzzer-no-link)
  add_compile_definitions(_GLIBCXX_ASSERTIONS) # libstdc++ checks its bounds
endif()
# By clang, whose warnings are others: gcc has judged the same sources.
if(FINGERTIP_LIBFUZZER OR CMAKE_SYSTEM_PROCESSOR STREQUAL "wasm32")
  target_compile_options(ft_warnings INTERFACE -w)
endif()
