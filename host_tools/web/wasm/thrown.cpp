// What C++ throws goes to the page as an error with its text: the import fingertip.thrown(text,
// length) throws in turn. Nothing on the way is destroyed; the page restores the stack's pointer.
#include <cstdlib>
#include <cstring>
#include <exception>
#include <typeinfo>

extern "C" {

[[noreturn]] __attribute__((import_module("fingertip"), import_name("thrown"))) void
fingertip_thrown(const char *text, std::size_t length);

void *__cxa_allocate_exception(std::size_t size) {
  return std::malloc(size);
}

// All that is thrown here derives from std::exception, and from nothing else.
[[noreturn]] void __cxa_throw(void *thrown, std::type_info *, void (*)(void *)) {
  const char *text = static_cast<std::exception *>(thrown)->what();
  fingertip_thrown(text, std::strlen(text));
}
}
