// What the programs of the fit report leave for fit.py.
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace fingertip::fitting {

// A number that is not finite becomes null. Throws std::runtime_error, which names the file.
inline void write_json(const std::string &path, const nlohmann::ordered_json &content) {
  std::ofstream file(path);
  file << content.dump(1) << '\n';
  file.close();
  if (!file) {
    throw std::runtime_error("cannot write " + path + ": is the folder there and the disk free?");
  }
}

} // namespace fingertip::fitting
