/* The functions of a firmware image, from the ELF file that it was linked into: 32 bits,
 * little-endian (Tool Interface Standard, Executable and Linking Format 1.2). */
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

class Symbols {
public:
  /* Throws Error: cannot_read, or other if it is no such file. */
  static Symbols of_file(const std::string &path);
  /* name: of the file, for errors. */
  Symbols(std::vector<std::uint8_t> file, const std::string &name);

  /* "fit_frame+0x1a"; nothing where no function is. */
  std::optional<std::string> place(std::uint32_t address) const;

  /* Whether these bytes are anywhere in the file. */
  bool holds(std::string_view text) const;

private:
  struct Function {
    std::uint32_t bytes;
    std::string name;
  };
  std::vector<std::uint8_t> file_;
  std::map<std::uint32_t, Function> functions_; /* by address */
};

} // namespace fingertip
