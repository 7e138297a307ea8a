#include "web/tables/objects_of_twin.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/framing.hpp"
#include "library/pad/profile.hpp"
#include "simulation/twin/traction_table.hpp"

namespace fingertip::web {

using twin::ForcePlanes;
using Symmetry = ForcePlanes::Symmetry;

// pressure_Pa(force_N, x_mm, y_mm) at the file's nodes.
template <typename Pressure> static ForcePlanes coarser(const Pressure &pressure_Pa, Symmetry in_x, Symmetry in_y) {
  std::vector<float> values;
  for (int f = 0; f < ForcePlanes::FORCES; f++) {
    const double force_N = ForcePlanes::force_at(f);
    for (int i = 0; i < ObjectsFile::NODES; i++) {
      for (int j = 0; j < ObjectsFile::NODES; j++) {
        values.push_back(static_cast<float>(pressure_Pa(force_N, ObjectsFile::STEP_mm * i, ObjectsFile::STEP_mm * j) / force_N));
      }
    }
  }
  return {std::move(values), in_x, in_y, ObjectsFile::STEP_mm, ObjectsFile::NODES};
}

static Object object_of(const std::string &name, const std::filesystem::path &cache) {
  const twin::Layer layer = twin::silicone(PAD_mm);
  const auto table = twin::ContactTable::load_or_build(twin::indenter(name), layer, cache);
  const twin::TractionTable traction(table, layer);
  Object object;
  object.name = name;
  for (int f = 0; f < ForcePlanes::FORCES; f++) {
    const double force_N = ForcePlanes::force_at(f);
    object.radius_mm.push_back(static_cast<float>(table.contact_radius_mm(force_N)));
    object.indentation_mm.push_back(static_cast<float>(table.indentation_mm(force_N)));
  }
  object.normal = coarser([&](double force_N, double x_mm, double y_mm) { return table.base_pressure_Pa(force_N, x_mm, y_mm); },
                          Symmetry::even, Symmetry::even);
  const auto pulled = [&](double x_share, double y_share) {
    return [&traction, x_share, y_share](double force_N, double x_mm, double y_mm) {
      return traction.base_pressure_Pa({force_N, 0.0, x_share * force_N, y_share * force_N}, x_mm, y_mm);
    };
  };
  object.along_x = coarser(pulled(1.0, 0.0), Symmetry::odd, Symmetry::even);
  object.along_y = coarser(pulled(0.0, 1.0), Symmetry::even, Symmetry::odd);
  return object;
}

const std::vector<std::string> &object_names() {
  static const std::vector<std::string> names{"sphere15", "sphere6", "cube12", "cube24", "cylinder24", "lime"};
  return names;
}

ObjectsFile objects_of_twin(const std::filesystem::path &cache) {
  ObjectsFile file;
  for (const std::string &name : object_names()) {
    file.objects.push_back(object_of(name, cache));
  }
  file.pad_command = frame_bytes(command_pad(pad::profile_over_own_sensors({PAD_mm})));
  return file;
}

} // namespace fingertip::web
