#include "report/reference/dataset.hpp"

#include "libfingertip/in_parallel.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <atomic>
#include <bitset>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string_view>

namespace fingertip::reference {
namespace {

// One press in the cache file, as this machine stores it: the file never leaves its build folder.
struct Record {
  std::uint64_t key;
  double p0_Pa, x_mm, y_mm, sigma_mm;
  double cost, force_N, location_sd_mm, condition_number;
  std::uint64_t at_bound;
};

std::int32_t largest_usable(const Case &c) {
  std::int32_t largest = INT32_MIN;
  for (std::size_t k = 0; k < c.pressure_Pa_q10.size(); k++) {
    if (c.usable >> k & 1u) {
      largest = std::max(largest, c.pressure_Pa_q10[k]);
    }
  }
  return largest;
}

// FNV-1a
std::uint64_t hash_bytes(std::uint64_t hash, const void *data, std::size_t size) {
  const auto *bytes = static_cast<const unsigned char *>(data);
  for (std::size_t i = 0; i < size; i++) {
    hash = (hash ^ bytes[i]) * 0x100000001B3u;
  }
  return hash;
}

std::uint64_t key_of(const Case &c) {
  constexpr std::string_view source = FINGERTIP_REFERENCE_SOURCE_HASH;
  std::uint64_t hash = hash_bytes(0xCBF29CE484222325u, source.data(), source.size());
  hash = hash_bytes(hash, c.pressure_Pa_q10.data(), 4 * c.pressure_Pa_q10.size());
  hash = hash_bytes(hash, &c.usable, sizeof c.usable);
  return hash_bytes(hash, &c.press.noise_Pa, sizeof c.press.noise_Pa);
}

Record solve(const Array &array, const Case &c) {
  std::vector<double> pressure_Pa;
  for (std::int32_t q10 : c.pressure_Pa_q10) {
    pressure_Pa.push_back(q10 / 1024.0);
  }
  // The truth is a good start where it is a Gaussian, and an honest one where it is not.
  const double peak_Pa = *std::max_element(pressure_Pa.begin(), pressure_Pa.end());
  const double sigma_mm = std::clamp(std::sqrt(1e6 * c.press.force_N / (2.0 * M_PI * peak_Pa)), 2.0, 40.0);
  if (largest_usable(c) <= 0) {
    const double infinity = std::numeric_limits<double>::infinity();
    return {key_of(c), 0, 0, 0, 0, 0, 0, infinity, infinity, 0};
  }
  const Fit best =
      fit(array, pressure_Pa, c.usable, c.press.noise_Pa, {{peak_Pa, c.press.x_mm, c.press.y_mm, sigma_mm}});
  return {key_of(c), best.theta.p0_Pa, best.theta.x_mm,     best.theta.y_mm,       best.theta.sigma_mm,
          best.cost, best.force_N,     best.location_sd_mm, best.condition_number, best.at_bound};
}

std::vector<Record> read_records(const std::string &path) {
  std::vector<Record> records;
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    return records;
  }
  records.resize(size / sizeof(Record));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char *>(records.data()), static_cast<std::streamsize>(records.size() * sizeof(Record)));
  if (!file) {
    records.clear();
  }
  return records;
}

// Written beside and moved into place: a killed run leaves the old file.
void write_records(const std::string &path, const std::vector<Record> &records) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  const std::string fresh = path + "." + std::to_string(std::chrono::steady_clock::now().time_since_epoch().count());
  std::ofstream file(fresh, std::ios::binary);
  file.write(reinterpret_cast<const char *>(records.data()),
             static_cast<std::streamsize>(records.size() * sizeof(Record)));
  file.close();
  if (!file) {
    std::filesystem::remove(fresh);
    throw std::runtime_error("cannot write " + fresh + ": is the folder writable and the disk free?");
  }
  std::filesystem::rename(fresh, path);
}

std::uint32_t usable_of(const Press &press, const std::vector<std::int32_t> &q10, Mask mask, Random random) {
  const auto count = press.pressure_Pa.size();
  const std::uint32_t all = (std::uint32_t{1} << count) - 1;
  if (mask == Mask::none) {
    return all;
  }
  if (mask == Mask::peak) {
    return all & ~(std::uint32_t{1} << (std::max_element(q10.begin(), q10.end()) - q10.begin()));
  }
  const std::size_t left = count - (mask == Mask::random ? 1 : mask == Mask::random2 ? 2 : 3);
  std::uint32_t usable = all;
  while (std::bitset<32>(usable).count() > left) {
    usable &= ~(std::uint32_t{1} << random.next() % count);
  }
  return usable;
}

} // namespace

const char *name_of(Mask mask) {
  static const char *const names[] = {"none", "random", "peak", "random2", "random3"};
  return names[static_cast<int>(mask)];
}

Array firmware_array() {
  Array array;
  array.pitch_mm = static_cast<double>(geometry.pitch_mm);
  for (int k = 0; k < geometry.sensor_count; k++) {
    array.x_mm.push_back(static_cast<double>(geometry.x_mm[k]));
    array.y_mm.push_back(static_cast<double>(geometry.y_mm[k]));
  }
  return array;
}

std::vector<Case> load_cases(PressSet set, Mask mask, std::uint64_t seed, std::size_t count,
                             const std::string &cache_dir) {
  constexpr std::uint64_t MASK_STREAM = 1000;
  const Array array = firmware_array();
  std::vector<Case> cases(count);
  twin::in_parallel(count, [&](std::size_t i) {
    Case &c = cases[i];
    c.press = make_press(set, array, seed, i);
    c.pressure_Pa_q10 = quantise(c.press.pressure_Pa);
    c.usable =
        usable_of(c.press, c.pressure_Pa_q10, mask, Random(seed, MASK_STREAM + static_cast<std::uint64_t>(set), i));
  });

  const std::string path =
      cache_dir + "/reference_" + std::to_string(seed) + "_" + name_of(set) + "_" + name_of(mask) + ".bin";
  std::vector<Record> records = read_records(path);
  records.resize(std::max(records.size(), count));
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < count; i++) {
    if (records[i].key != key_of(cases[i])) {
      missing.push_back(i);
    }
  }
  if (!missing.empty()) {
    std::atomic<std::size_t> done{0};
    twin::in_parallel(missing.size(), [&](std::size_t m) {
      records[missing[m]] = solve(array, cases[missing[m]]);
      const std::size_t now = ++done;
      if (now % 2000 == 0 || now == missing.size()) {
        std::fprintf(stderr, "\rreference of set %c, mask %s: %zu of %zu ", name_of(set), name_of(mask), now,
                     missing.size());
      }
    });
    std::fputc('\n', stderr);
    write_records(path, records);
  }
  for (std::size_t i = 0; i < count; i++) {
    Case &c = cases[i];
    const Record &r = records[i];
    c.best = {{r.p0_Pa, r.x_mm, r.y_mm, r.sigma_mm},
              r.cost,
              r.force_N,
              r.location_sd_mm,
              r.condition_number,
              r.at_bound != 0};
    c.observable =
        observable(c.best) && !c.best.at_bound && largest_usable(c) >= GATE_SIGMAS * 1024.0 * c.press.noise_Pa;
  }
  return cases;
}

} // namespace fingertip::reference
