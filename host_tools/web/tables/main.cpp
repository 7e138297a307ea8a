// usage: web_tables OUTPUT CACHE: writes the file of objects for the page's simulated fingertip.
#include "web/tables/objects_of_twin.hpp"

#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>

int main(int argc, char **argv) {
  try {
    if (argc != 3) {
      throw std::runtime_error("usage: web_tables OUTPUT CACHE");
    }
    const auto bytes = fingertip::web::written(fingertip::web::objects_of_twin(argv[2]));
    std::ofstream out(argv[1], std::ios::binary);
    out.write(reinterpret_cast<const char *>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) {
      throw std::runtime_error(std::string(argv[1]) + ": cannot be written");
    }
    return 0;
  } catch (const std::exception &error) {
    (void)std::fprintf(stderr, "web_tables: %s\n", error.what());
  }
  return 1;
}
