#include "libfingertip/error.hpp"
#include "libfingertip/line_source.hpp"
#include "tool/doctor/crash.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <elf.h>
#include <utility>

namespace fingertip {

/* An assembler's label without a size reaches to the next function, but no farther than this. */
constexpr std::uint32_t UNSIZED_MAX_bytes = 4096;

template <typename Part> static Part part_at(const std::vector<std::uint8_t> &file, std::size_t at, const std::string &name) {
  Part part;
  if (at > file.size() || file.size() - at < sizeof part) {
    throw Error(name + ": is cut short; give the ELF file of this firmware");
  }
  std::memcpy(&part, file.data() + at, sizeof part);
  return part;
}

Symbols Symbols::of_file(const std::string &path) { return Symbols(all_bytes(path), path); }

Symbols::Symbols(std::vector<std::uint8_t> file, const std::string &name) : file_(std::move(file)) {
  bool is_elf = file_.size() > EI_DATA && std::memcmp(file_.data(), ELFMAG, SELFMAG) == 0 && file_[EI_CLASS] == ELFCLASS32 &&
                file_[EI_DATA] == ELFDATA2LSB;
  if (!is_elf || part_at<Elf32_Ehdr>(file_, 0, name).e_machine != EM_ARM) {
    throw Error(name + ": no ELF file of a fingertip; give fingertip-BOARD.elf");
  }
  auto header = part_at<Elf32_Ehdr>(file_, 0, name);
  auto section = [&](std::size_t i) { return part_at<Elf32_Shdr>(file_, header.e_shoff + i * sizeof(Elf32_Shdr), name); };
  for (unsigned i = 0; i < header.e_shnum; i++) {
    Elf32_Shdr table = section(i);
    if (table.sh_type != SHT_SYMTAB || table.sh_link >= header.e_shnum) {
      continue;
    }
    Elf32_Shdr names = section(table.sh_link);
    for (std::size_t at = 0; at + sizeof(Elf32_Sym) <= table.sh_size; at += sizeof(Elf32_Sym)) {
      auto symbol = part_at<Elf32_Sym>(file_, table.sh_offset + at, name);
      std::size_t text_at = std::size_t{names.sh_offset} + symbol.st_name;
      if (ELF32_ST_TYPE(symbol.st_info) != STT_FUNC || symbol.st_name >= names.sh_size || text_at >= file_.size()) {
        continue;
      }
      auto text = file_.begin() + static_cast<std::ptrdiff_t>(text_at);
      functions_[symbol.st_value & ~1u] = {symbol.st_size, std::string(text, std::find(text, file_.end(), '\0'))};
    }
  }
}

std::optional<std::string> Symbols::place(std::uint32_t address) const {
  auto after = functions_.upper_bound(address);
  if (after == functions_.begin()) {
    return std::nullopt;
  }
  const auto &[start, function] = *std::prev(after);
  std::uint32_t offset = address - start;
  if (offset >= (function.bytes ? function.bytes : UNSIZED_MAX_bytes)) {
    return std::nullopt;
  }
  char text[16];
  std::snprintf(text, sizeof text, "+0x%x", static_cast<unsigned>(offset));
  return function.name + text;
}

bool Symbols::holds(std::string_view text) const {
  return std::search(file_.begin(), file_.end(), text.begin(), text.end()) != file_.end();
}

} // namespace fingertip
