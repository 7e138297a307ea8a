#include "web/wasm/objects.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace fingertip::web {
namespace {

using twin::ForcePlanes;
using Symmetry = ForcePlanes::Symmetry;

constexpr int FORCES = ForcePlanes::FORCES, NODES = ObjectsFile::NODES;
constexpr char MARK[] = "FTPAD 1\n";
constexpr std::size_t MARK_BYTES = sizeof MARK - 1;
constexpr double PARTS = 32767.0;
constexpr std::uint32_t OBJECTS_MAX = 64;

static_assert(sizeof(float) == 4);

void put(std::vector<std::uint8_t> &bytes, const void *value, std::size_t length) {
  const auto *begin = static_cast<const std::uint8_t *>(value);
  bytes.insert(bytes.end(), begin, begin + length);
}

void put_field(std::vector<std::uint8_t> &bytes, const ForcePlanes &planes) {
  for (int f = 0; f < FORCES; f++) {
    double largest = 0.0;
    for (int node = 0; node < NODES * NODES; node++) {
      largest = std::max(largest, std::abs(planes.node(f, node / NODES, node % NODES)));
    }
    const float scale = static_cast<float>(largest);
    put(bytes, &scale, sizeof scale);
    for (int node = 0; node < NODES * NODES; node++) {
      const double value = planes.node(f, node / NODES, node % NODES);
      const auto part = static_cast<std::int16_t>(largest > 0.0 ? std::lround(PARTS * value / largest) : 0);
      put(bytes, &part, sizeof part);
    }
  }
}

class Reader {
public:
  Reader(const std::uint8_t *bytes, std::size_t length) : at_(bytes), left_(length) {}

  void take(void *value, std::size_t length) {
    if (length > left_) {
      throw std::runtime_error("the objects' file ends too early; load the page again");
    }
    std::memcpy(value, at_, length);
    at_ += length;
    left_ -= length;
  }
  std::vector<float> floats() {
    std::vector<float> values(FORCES);
    take(values.data(), FORCES * sizeof(float));
    return values;
  }
  ForcePlanes field(Symmetry in_x, Symmetry in_y) {
    std::vector<float> values;
    std::vector<std::int16_t> parts(NODES * NODES);
    for (int f = 0; f < FORCES; f++) {
      float scale = 0.0F;
      take(&scale, sizeof scale);
      take(parts.data(), parts.size() * sizeof parts[0]);
      for (const std::int16_t part : parts) {
        values.push_back(static_cast<float>(static_cast<double>(scale) / PARTS * part));
      }
    }
    return {std::move(values), in_x, in_y, ObjectsFile::STEP_mm, NODES};
  }
  std::vector<std::uint8_t> rest() const { return {at_, at_ + left_}; }

private:
  const std::uint8_t *at_;
  std::size_t left_;
};

} // namespace

std::vector<std::uint8_t> written(const ObjectsFile &file) {
  std::vector<std::uint8_t> bytes;
  put(bytes, MARK, MARK_BYTES);
  const auto count = static_cast<std::uint32_t>(file.objects.size());
  put(bytes, &count, sizeof count);
  for (const Object &object : file.objects) {
    std::array<char, ObjectsFile::NAME_BYTES> name{};
    std::copy_n(object.name.begin(), std::min(object.name.size(), name.size()), name.begin());
    put(bytes, name.data(), name.size());
    put(bytes, object.radius_mm.data(), FORCES * sizeof(float));
    put(bytes, object.indentation_mm.data(), FORCES * sizeof(float));
    put_field(bytes, object.normal);
    put_field(bytes, object.along_x);
    put_field(bytes, object.along_y);
  }
  put(bytes, file.pad_command.data(), file.pad_command.size());
  return bytes;
}

ObjectsFile read_objects(const std::uint8_t *bytes, std::size_t length) {
  Reader reader(bytes, length);
  std::array<char, MARK_BYTES> mark{};
  reader.take(mark.data(), mark.size());
  std::uint32_t count = 0;
  reader.take(&count, sizeof count);
  if (std::memcmp(mark.data(), MARK, MARK_BYTES) != 0 || count > OBJECTS_MAX) {
    throw std::runtime_error("no file of objects; load the page again");
  }
  ObjectsFile file;
  for (std::uint32_t i = 0; i < count; i++) {
    std::array<char, ObjectsFile::NAME_BYTES + 1> name{};
    reader.take(name.data(), ObjectsFile::NAME_BYTES);
    Object object;
    object.name = name.data();
    object.radius_mm = reader.floats();
    object.indentation_mm = reader.floats();
    object.normal = reader.field(Symmetry::even, Symmetry::even);
    object.along_x = reader.field(Symmetry::odd, Symmetry::even);
    object.along_y = reader.field(Symmetry::even, Symmetry::odd);
    file.objects.push_back(std::move(object));
  }
  file.pad_command = reader.rest();
  return file;
}

} // namespace fingertip::web
