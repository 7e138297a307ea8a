#include "libfingertip/names.hpp"

#include "libfingertip/line_fields.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/wire.hpp"

namespace fingertip {

const std::vector<FlagName> &flag_names() {
  static const std::vector<FlagName> names = [] {
    std::vector<FlagName> all;
    for (const words::Flag &flag : words::flags) {
      all.push_back({flag.bit, flag.name, flag.warning});
    }
    return all;
  }();
  return names;
}

std::uint32_t warning_flags() {
  std::uint32_t warnings = 0;
  for (const words::Flag &flag : words::flags) {
    warnings |= flag.warning ? flag.bit : 0;
  }
  return warnings;
}

std::string flags_text(std::uint32_t flags) {
  std::vector<std::string> names;
  for (const FlagName &flag : flag_names()) {
    names.emplace_back(flags & flag.bit ? flag.name : "");
    flags &= ~flag.bit;
  }
  for (int bit = 0; bit < 32; bit++) {
    names.push_back(flags >> bit & 1u ? "bit" + std::to_string(bit) : "");
  }
  return joined(names, " ");
}

template <std::size_t count> static const char *word_of(const words::Word (&all)[count], std::uint32_t value) {
  const auto *found = find_in(all, [&](const words::Word &each) { return each.value == value; });
  return found ? found->word : nullptr;
}

template <std::size_t count> static std::string bits_text(const words::Word (&all)[count], std::uint32_t bits, const char *none) {
  const std::string text = joined(all, ",", [&](const words::Word &each) { return bits & each.value ? each.word : ""; });
  return text.empty() ? none : text;
}

std::string command_name(std::uint8_t type) {
  const char *word = word_of(words::commands, type);
  return word ? word : "0x" + hex({type});
}

std::string result_text(std::uint8_t result) {
  const char *word = word_of(words::results, result);
  return word ? word : "result " + std::to_string(result);
}

std::string capabilities_text(std::uint32_t capabilities) { return bits_text(words::capabilities, capabilities, "none"); }

std::string stored_text(std::uint32_t stored) { return bits_text(words::stored, stored, "nothing"); }

std::string streams_text(std::uint8_t streams) { return bits_text(words::streams, streams, "none"); }

} // namespace fingertip
