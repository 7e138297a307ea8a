/* wasi-libc has none. What jumps out of the firmware (native/native_port.h) ends it instead: the
 * page's import fingertip.leave(value) throws, and the module's memory is not run again. */
#ifndef WEB_WASM_SETJMP_H
#define WEB_WASM_SETJMP_H

typedef char jmp_buf[1];

#define setjmp(out) ((void)(out), 0)
#define longjmp(out, value) fingertip_leave(value)

__attribute__((import_module("fingertip"), import_name("leave"))) _Noreturn void fingertip_leave(int value);

#endif
