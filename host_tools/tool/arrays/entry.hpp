// How Python's fingertip.arrays calls C++: arrays in, arrays out, all of them the caller's.
//
// An entry point is one function and one line:
//
//   void fit(Batch<const std::int32_t, 2> pressure_Pa_q10, double noise_Pa, Batch<fit_result, 1> result) { ... }
//   MEASURE_ENTRY(fit)
//
// Its parameters are arrays, numbers and texts. Each argument is checked against its parameter: type of an
// item, number of dimensions, and whether an array that the function writes may be written. Shapes are the function's
// own to check (require, same_length). What it throws becomes a Python exception with its text.
//
// A struct that an array holds is listed, so that numpy knows its fields:
//
//   MEASURE_RECORD(fit_result, FIELD(x_mm), FIELD(y_mm), ...)
//
// A struct that Python only carries from call to call needs no fields.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// As fingertip.arrays fills it in.
struct measure_argument {
  void *data; // of an array or a text
  std::int64_t shape[4];
  std::int64_t integer; // of a number without a fraction
  double real;          // of any number
  std::int32_t dimensions, item_bytes;
  char kind; // numpy's letter of an item, or 'n' of a number, 'r' of one with a fraction, 't' of a text
  bool writable;
};

namespace fingertip::measure {

// Rows of C order.
template <class Item, int DIMENSIONS> struct Batch {
  Item *data;
  std::array<std::int64_t, DIMENSIONS> shape;

  std::size_t size(int dimension = 0) const { return static_cast<std::size_t>(shape[static_cast<std::size_t>(dimension)]); }
  // What an index of the first dimension holds: an item, or the first item of a row.
  std::size_t stride() const {
    std::size_t items = 1;
    for (int i = 1; i < DIMENSIONS; i++) {
      items *= size(i);
    }
    return items;
  }
  Item *row(std::size_t i) const { return data + i * stride(); }
  Item &operator[](std::size_t i) const { return data[i]; }
  // Row i of an array that has one for each, or the only one that is for all.
  Item *row_or_all(std::size_t i) const { return row(size() == 1 ? 0 : i); }
};

inline void require(bool holds, const char *otherwise) {
  if (!holds) {
    throw std::invalid_argument(otherwise);
  }
}

template <class First, class... More> void same_length(const First &first, const More &...more) {
  require(((more.size() == first.size()) && ...), "arrays of different lengths");
}

// Length 1 is for all.
template <class First, class... More> void length_or_one(const First &first, const More &...more) {
  require(((more.size() == first.size() || more.size() == 1) && ...), "an array has neither one row nor one for each");
}

struct Field {
  std::string name;
  std::size_t offset, count; // count: of items; 0: no array
  char kind;
  std::size_t item_bytes;
};

struct Record {
  std::string name;
  std::size_t bytes;
  std::vector<Field> fields;
};

bool list_record(Record record);

template <class Item> constexpr char kind_of() {
  if constexpr (std::is_same_v<Item, char>) {
    return 'S'; // a text
  } else if constexpr (std::is_same_v<Item, bool>) {
    return 'b';
  } else if constexpr (std::is_floating_point_v<Item>) {
    return 'f';
  } else if constexpr (std::is_enum_v<Item>) {
    return std::is_signed_v<std::underlying_type_t<Item>> ? 'i' : 'u';
  } else if constexpr (std::is_integral_v<Item>) {
    return std::is_signed_v<Item> ? 'i' : 'u';
  } else {
    return 'V';
  }
}

template <class Member> Field field(const char *name, std::size_t offset) {
  using Item = std::remove_all_extents_t<Member>;
  return {name, offset, std::is_array_v<Member> ? sizeof(Member) / sizeof(Item) : 0, kind_of<Item>(), sizeof(Item)};
}

template <class Parameter> struct Unpack;

template <class Item, int DIMENSIONS> struct Unpack<Batch<Item, DIMENSIONS>> {
  static Batch<Item, DIMENSIONS> from(const measure_argument &argument) {
    require(argument.kind == kind_of<std::remove_const_t<Item>>() && argument.item_bytes == int{sizeof(Item)},
            "an array of another type of item");
    require(argument.dimensions == DIMENSIONS, "an array of another number of dimensions");
    require(std::is_const_v<Item> || argument.writable, "an array that is written, and may not be");
    Batch<Item, DIMENSIONS> array{static_cast<Item *>(argument.data), {}};
    for (std::size_t i = 0; i < DIMENSIONS; i++) {
      array.shape[i] = argument.shape[i];
    }
    return array;
  }
};

template <> struct Unpack<double> {
  static double from(const measure_argument &argument) {
    require(argument.kind == 'n' || argument.kind == 'r', "no number");
    return argument.real;
  }
};

template <> struct Unpack<std::int64_t> {
  static std::int64_t from(const measure_argument &argument) {
    require(argument.kind == 'n', "no whole number");
    return argument.integer;
  }
};

template <> struct Unpack<std::string> {
  static std::string from(const measure_argument &argument) {
    require(argument.kind == 't', "no text");
    return static_cast<const char *>(argument.data);
  }
};

// Keeps what measure_failure() returns.
void failed(const char *entry, const char *what);

// Argument `index`, counted from 0.
template <class Parameter> Parameter unpacked(const measure_argument *arguments, std::size_t index) {
  try {
    return Unpack<Parameter>::from(arguments[index]);
  } catch (const std::exception &error) {
    throw std::invalid_argument("argument " + std::to_string(index + 1) + ": " + error.what());
  }
}

template <class... Parameters, std::size_t... INDEX>
void call_with(const measure_argument *arguments, void (*function)(Parameters...), std::index_sequence<INDEX...>) {
  function(unpacked<Parameters>(arguments, INDEX)...);
}

template <class... Parameters>
int call(const char *entry, const measure_argument *arguments, std::int64_t count, void (*function)(Parameters...)) {
  try {
    require(count == std::int64_t{sizeof...(Parameters)}, "another number of arguments");
    call_with(arguments, function, std::index_sequence_for<Parameters...>());
    return 0;
  } catch (const std::exception &error) {
    failed(entry, error.what());
    return 1;
  }
}

} // namespace fingertip::measure

#define MEASURE_ENTRY(name)                                                                                                                \
  extern "C" __attribute__((visibility("default"))) int measure_##name(const measure_argument *arguments, std::int64_t count) {            \
    return fingertip::measure::call(#name, arguments, count, &name);                                                                       \
  }

#define MEASURE_RECORD(type, ...)                                                                                                          \
  [[maybe_unused]] static const bool type##_is_listed = [] {                                                                               \
    using Struct = type;                                                                                                                   \
    return fingertip::measure::list_record({#type, sizeof(Struct), {__VA_ARGS__}});                                                        \
  }();
#define FIELD(member) fingertip::measure::field<decltype(Struct::member)>(#member, offsetof(Struct, member))
