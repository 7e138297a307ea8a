#include "twin/contact_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <unistd.h>

namespace fingertip::twin {
namespace {

constexpr int FORCES = ForcePlanes::FORCES, NODES = ForcePlanes::NODES;
constexpr double STEP_mm = ForcePlanes::STEP_mm;
constexpr std::size_t PLANE = ForcePlanes::PLANE;
constexpr std::size_t VALUES = FORCES * PLANE;
// To be raised whenever a solution changes.
constexpr int VERSION = 1;

std::uint64_t fnv1a(const void *data, std::size_t length) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (std::size_t i = 0; i < length; i++) {
    hash = (hash ^ static_cast<const unsigned char *>(data)[i]) * 0x100000001b3u;
  }
  return hash;
}

// All that the numbers depend on.
std::string key_of(const Indenter &indenter, const Layer &layer, const Grid &grid) {
  char text[256];
  std::snprintf(text, sizeof text,
                "contact-table %d: %d %.9g %.9g %.9g %.9g %.9g on %.9g %.9g %.9g grid %d %.9g "
                "forces %d %.9g %.9g step %.9g %d",
                VERSION, static_cast<int>(indenter.shape), indenter.size_x_mm, indenter.size_y_mm,
                indenter.size_z_mm, indenter.edge_mm, indenter.youngs_modulus_Pa,
                layer.thickness_mm, layer.youngs_modulus_Pa, layer.poisson, grid.nodes,
                grid.step_mm, FORCES, ContactTable::FORCE_MIN_N, ContactTable::FORCE_MAX_N, STEP_mm,
                NODES);
  return text;
}

} // namespace

double ContactTable::indentation_mm(double force_N) const {
  return force_N > 0.0 ? ForcePlanes::between_forces(indentation_mm_, force_N) : 0.0;
}

double ContactTable::contact_radius_mm(double force_N) const {
  return force_N > 0.0 ? ForcePlanes::between_forces(radius_mm_, force_N) : 0.0;
}

ContactTable ContactTable::load_or_build(const Indenter &indenter, const Layer &layer,
                                         const std::filesystem::path &cache_directory,
                                         const std::function<void(double)> &on_progress) {
  const Grid grid = grid_for(indenter, layer);
  const std::string key = key_of(indenter, layer, grid);
  char name[96];
  std::snprintf(name, sizeof name, "%s-h%g-%016llx.table", indenter.name.c_str(),
                layer.thickness_mm, static_cast<unsigned long long>(fnv1a(key.data(), key.size())));
  const std::filesystem::path path = cache_directory / name;

  // The key, the values, and a hash of both.
  std::vector<float> values(VALUES + 2 * FORCES);
  const std::size_t value_bytes = values.size() * sizeof(float);
  std::vector<char> file(key.size() + value_bytes + sizeof(std::uint64_t));
  const auto hash_of_file = [&] { return fnv1a(file.data(), key.size() + value_bytes); };
  std::ifstream in(path, std::ios::binary);
  std::uint64_t hash = 0;
  bool found = static_cast<bool>(in.read(file.data(), static_cast<std::streamsize>(file.size())));
  if (found) {
    std::memcpy(&hash, file.data() + key.size() + value_bytes, sizeof hash);
    found = std::equal(key.begin(), key.end(), file.begin()) && hash == hash_of_file();
  }
  if (found) {
    std::memcpy(values.data(), file.data() + key.size(), value_bytes);
  } else {
    ContactSolver solver(indenter, layer, grid);
    const int stride = static_cast<int>(std::lround(STEP_mm / grid.step_mm));
    for (int f = 0; f < FORCES; f++) {
      const Contact contact = solver.solve(ForcePlanes::force_at(f));
      for (int i = 0; i < NODES; i++) {
        for (int j = 0; j < NODES; j++) {
          const std::size_t from =
              std::size_t(grid.nodes / 2 + i * stride) * std::size_t(grid.nodes) +
              std::size_t(grid.nodes / 2 + j * stride);
          values[std::size_t(f) * PLANE + std::size_t(i * NODES + j)] =
              static_cast<float>(contact.base_Pa[from] / contact.force_N);
        }
      }
      values[VALUES + std::size_t(f)] = static_cast<float>(contact.indentation_mm);
      values[VALUES + FORCES + std::size_t(f)] =
          static_cast<float>(std::sqrt(contact.contact_area_mm2 / M_PI));
      if (on_progress) {
        on_progress((f + 1.0) / FORCES);
      }
    }
    std::copy(key.begin(), key.end(), file.begin());
    std::memcpy(file.data() + key.size(), values.data(), value_bytes);
    hash = hash_of_file();
    std::memcpy(file.data() + key.size() + value_bytes, &hash, sizeof hash);
    std::filesystem::create_directories(cache_directory);
    const std::filesystem::path temporary = path.string() + "." + std::to_string(getpid());
    std::ofstream out(temporary, std::ios::binary);
    out.write(file.data(), static_cast<std::streamsize>(file.size()));
    out.close();
    if (!out) {
      std::filesystem::remove(temporary);
      throw std::runtime_error("cannot write " + temporary.string() +
                               "; make room or give another --cache");
    }
    std::filesystem::rename(temporary, path);
  }
  ContactTable table;
  const auto begin = values.begin();
  table.pressure_ = {
      {begin, begin + VALUES}, ForcePlanes::Symmetry::even, ForcePlanes::Symmetry::even};
  table.indentation_mm_.assign(begin + VALUES, begin + VALUES + FORCES);
  table.radius_mm_.assign(begin + VALUES + FORCES, values.end());
  return table;
}

std::filesystem::path default_cache_directory() {
  const char *cache = std::getenv("XDG_CACHE_HOME"), *home = std::getenv("HOME");
  const std::filesystem::path base =
      cache && *cache ? std::filesystem::path(cache)
                      : std::filesystem::path(home && *home ? home : ".") / ".cache";
  return base / "fingertip" / "contact-tables";
}

} // namespace fingertip::twin
