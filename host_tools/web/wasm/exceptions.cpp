// The runtime of C++ exceptions, on the exceptions of WebAssembly (legacy proposal; Chrome 95, node 17): Debian's libc++ for it is built
// without. The compiler writes try, catch and rethrow; here is what it calls: the exception objects, and which landing pad takes which
// (Itanium C++ ABI, its tables of language-specific data). A class has one base at most. An uncaught exception ends the page's
// call: module.mjs asks exception_text for its message.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <typeinfo>

namespace {

// The header before each exception object. Destructors return their object on this machine.
struct Exception {
  const std::type_info *type;
  void *(*destroy)(void *);
  Exception *outer;  // the one that was being handled before it
  unsigned handlers; // handlers that are at work on it
  bool is_passed_on; // the handler that ends next passes it on

  void *object() { return this + 1; }
  static Exception *of(void *object) { return static_cast<Exception *>(object) - 1; }
};

Exception *handled = nullptr; // innermost
Exception *in_flight = nullptr;

extern "C" const void *const _ZTVN10__cxxabiv120__si_class_type_infoE[];

// Whether the type is this class or derived from it.
bool is_a(const std::type_info *type, const std::type_info *wanted) {
  while (std::strcmp(type->name(), wanted->name()) != 0) {
    const void *words[3]; // of __si_class_type_info: virtual table, name, base
    std::memcpy(words, static_cast<const void *>(type), sizeof words);
    if (words[0] != &_ZTVN10__cxxabiv120__si_class_type_infoE[2]) {
      return false;
    }
    type = static_cast<const std::type_info *>(words[2]);
  }
  return true;
}

/* A number in LEB128. */
std::int32_t read_leb(const std::uint8_t *&at, bool is_signed = false) {
  std::uint32_t value = 0;
  unsigned bits = 0;
  std::uint8_t byte;
  do {
    byte = *at++;
    value |= std::uint32_t{byte & 0x7Fu} << bits;
    bits += 7;
  } while (byte & 0x80);
  const bool negative = is_signed && (byte & 0x40) != 0 && bits < 32;
  return static_cast<std::int32_t>(negative ? value | ~0u << bits : value);
}

void destroy(Exception *exception) {
  if (exception->destroy) {
    exception->destroy(exception->object());
  }
  std::free(exception);
}

[[noreturn]] void fly(Exception *exception) {
  in_flight = exception;
  __builtin_wasm_throw(0, exception);
}

} // namespace

extern "C" {

// The landing pad asks with index and lsda, and finds which of its handlers takes the object; 0: none.
struct {
  std::uintptr_t index;
  const std::uint8_t *lsda;
  std::uintptr_t selector;
} __wasm_lpad_context;

int _Unwind_CallPersonality(void *exception) {
  constexpr std::uint8_t OMITTED = 0xFF;
  auto &pad = __wasm_lpad_context;
  pad.selector = 0;
  const std::uint8_t *at = pad.lsda + 1; // without an address of landing pads
  const bool has_types = *at++ != OMITTED;
  const std::int32_t types_after = has_types ? read_leb(at) : 0;
  const std::uint8_t *types = at + types_after;
  at++; // how call sites are written
  const std::int32_t sites = read_leb(at);
  const std::uint8_t *actions = at + sites;
  std::int32_t action = 0;
  for (std::uintptr_t i = 0; i <= pad.index; i++) {
    read_leb(at); // the landing pad itself
    action = read_leb(at);
  }
  for (at = actions + action - 1; action != 0;) {
    const std::int32_t filter = read_leb(at, true);
    const std::uint8_t *here = at;
    const std::int32_t next = read_leb(at, true);
    if (filter > 0) {
      const std::type_info *wanted; // null: catch (...)
      std::memcpy(&wanted, types - filter * static_cast<int>(sizeof wanted), sizeof wanted);
      if (!wanted || is_a(static_cast<Exception *>(exception)->type, wanted)) {
        pad.selector = static_cast<std::uintptr_t>(filter);
        break;
      }
    }
    if (next == 0) {
      break;
    }
    at = here + next;
  }
  return 0;
}

void *__cxa_allocate_exception(std::size_t size) {
  auto *exception = static_cast<Exception *>(std::calloc(1, sizeof(Exception) + size));
  if (!exception) {
    std::abort();
  }
  return exception->object();
}

void __cxa_free_exception(void *object) { std::free(Exception::of(object)); }

[[noreturn]] void __cxa_throw(void *object, std::type_info *type, void *(*destroy)(void *)) {
  Exception *exception = Exception::of(object);
  exception->type = type;
  exception->destroy = destroy;
  fly(exception);
}

[[noreturn]] void _Unwind_Resume(void *exception) { fly(static_cast<Exception *>(exception)); }

void *__cxa_begin_catch(void *object) {
  auto *exception = static_cast<Exception *>(object);
  if (exception->handlers++ == 0) {
    exception->outer = handled;
    handled = exception;
  }
  exception->is_passed_on = false;
  in_flight = nullptr;
  return exception->object();
}

void *__cxa_get_exception_ptr(void *exception) { return static_cast<Exception *>(exception)->object(); }

void __cxa_end_catch() {
  Exception *exception = handled;
  if (--exception->handlers > 0) {
    return;
  }
  handled = exception->outer;
  if (!exception->is_passed_on) {
    destroy(exception);
  }
}

[[noreturn]] void __cxa_rethrow() {
  handled->is_passed_on = true;
  fly(handled);
}

// The message of the uncaught exception, until the next call; empty if it is no std::exception.
__attribute__((export_name("exception_text"))) const char *exception_text() {
  static char text[1024];
  if (!in_flight) {
    return nullptr;
  }
  text[0] = '\0';
  if (is_a(in_flight->type, &typeid(std::exception))) {
    const char *what = static_cast<std::exception *>(in_flight->object())->what();
    std::strncpy(text, what, sizeof text - 1);
  }
  destroy(in_flight);
  in_flight = nullptr;
  return text;
}
}
