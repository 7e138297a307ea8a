// What C++ throws, on the exceptions of WebAssembly (legacy proposal; Chrome 95, node 17): Debian's
// libc++ for it is built without. The compiler writes try, catch and rethrow; here is what it calls:
// the objects that are thrown, and which landing pad takes which (Itanium C++ ABI, its tables of
// language-specific data). A class has one base at most. What nothing catches ends in the page's call:
// module.mjs asks thrown_text for its words.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <typeinfo>

namespace {

// Before each thrown object. Destructors return their object on this machine.
struct Thrown {
  const std::type_info *type;
  void *(*destroy)(void *);
  Thrown *outer;     // that which was being handled before it
  unsigned handlers; // that are at work on it
  bool rethrown;     // the handler that ends next hands it on

  void *object() { return this + 1; }
  static Thrown *of(void *object) { return static_cast<Thrown *>(object) - 1; }
};

Thrown *handled = nullptr; // innermost
Thrown *in_flight = nullptr;

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

std::uint32_t read_uleb(const std::uint8_t *&at) {
  std::uint32_t value = 0;
  for (unsigned shift = 0;; shift += 7) {
    const std::uint8_t byte = *at++;
    value |= std::uint32_t{byte & 0x7Fu} << shift;
    if (!(byte & 0x80)) {
      return value;
    }
  }
}

std::int32_t read_sleb(const std::uint8_t *&at) {
  const std::uint8_t *begin = at;
  const std::uint32_t value = read_uleb(at);
  const unsigned bits = 7u * static_cast<unsigned>(at - begin);
  const bool negative = (at[-1] & 0x40) != 0 && bits < 32;
  return static_cast<std::int32_t>(negative ? value | ~0u << bits : value);
}

void destroy(Thrown *thrown) {
  if (thrown->destroy) {
    thrown->destroy(thrown->object());
  }
  std::free(thrown);
}

[[noreturn]] void fly(Thrown *thrown) {
  in_flight = thrown;
  __builtin_wasm_throw(0, thrown);
}

} // namespace

extern "C" {

// The landing pad asks with index and lsda, and finds which of its handlers takes the object; 0: none.
struct {
  std::uintptr_t index;
  const std::uint8_t *lsda;
  std::uintptr_t selector;
} __wasm_lpad_context;

int _Unwind_CallPersonality(void *thrown) {
  constexpr std::uint8_t OMITTED = 0xFF;
  auto &pad = __wasm_lpad_context;
  pad.selector = 0;
  const std::uint8_t *at = pad.lsda + 1; // without an address of landing pads
  const bool has_types = *at++ != OMITTED;
  const std::uint32_t types_after = has_types ? read_uleb(at) : 0;
  const std::uint8_t *types = at + types_after;
  at++; // how call sites are written
  const std::uint32_t sites = read_uleb(at);
  const std::uint8_t *actions = at + sites;
  std::uint32_t action = 0;
  for (std::uintptr_t i = 0; i <= pad.index; i++) {
    read_uleb(at); // the landing pad itself
    action = read_uleb(at);
  }
  for (at = actions + action - 1; action != 0;) {
    const std::int32_t filter = read_sleb(at);
    const std::uint8_t *here = at;
    const std::int32_t next = read_sleb(at);
    if (filter > 0) {
      const std::type_info *wanted; // null: catch (...)
      std::memcpy(&wanted, types - filter * static_cast<int>(sizeof wanted), sizeof wanted);
      if (!wanted || is_a(static_cast<Thrown *>(thrown)->type, wanted)) {
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
  auto *thrown = static_cast<Thrown *>(std::calloc(1, sizeof(Thrown) + size));
  if (!thrown) {
    std::abort();
  }
  return thrown->object();
}

void __cxa_free_exception(void *object) {
  std::free(Thrown::of(object));
}

[[noreturn]] void __cxa_throw(void *object, std::type_info *type, void *(*destroy)(void *)) {
  Thrown *thrown = Thrown::of(object);
  thrown->type = type;
  thrown->destroy = destroy;
  fly(thrown);
}

[[noreturn]] void _Unwind_Resume(void *thrown) {
  fly(static_cast<Thrown *>(thrown));
}

void *__cxa_begin_catch(void *object) {
  auto *thrown = static_cast<Thrown *>(object);
  if (thrown->handlers++ == 0) {
    thrown->outer = handled;
    handled = thrown;
  }
  thrown->rethrown = false;
  in_flight = nullptr;
  return thrown->object();
}

void *__cxa_get_exception_ptr(void *thrown) {
  return static_cast<Thrown *>(thrown)->object();
}

void __cxa_end_catch() {
  Thrown *thrown = handled;
  if (--thrown->handlers > 0) {
    return;
  }
  handled = thrown->outer;
  if (!thrown->rethrown) {
    destroy(thrown);
  }
}

[[noreturn]] void __cxa_rethrow() {
  handled->rethrown = true;
  fly(handled);
}

// The words of what nothing caught, until the next call of it; null where it is no std::exception.
__attribute__((export_name("thrown_text"))) const char *thrown_text() {
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
