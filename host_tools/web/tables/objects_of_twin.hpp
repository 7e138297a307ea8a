// The file of objects (web/wasm/objects.hpp), from the twin.
#pragma once

#include "web/wasm/objects.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace fingertip::web {

constexpr double PAD_mm = 12.0; // of silicone without ends

// The indenters that the page has (src/simulated/simulated_fingertip.ts has the same).
const std::vector<std::string> &object_names();

// Solves what is not in the cache, a second each.
ObjectsFile objects_of_twin(const std::filesystem::path &cache);

} // namespace fingertip::web
