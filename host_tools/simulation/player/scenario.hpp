/* What the sensors measure over time, as emulator/scenario.mjs has it. The ambient pressure is at most 1e7 Pa, too; temperatures are at
 * most 1000 degC. */
#pragma once

#include "simulation/player/samples.hpp"

#include <string>

namespace fingertip {

class Scenario : public Samples {
public:
  /* Throws Error with file and line. */
  explicit Scenario(const std::string &path);

  const std::string &name() const { return name_; }

private:
  std::string name_;
};

} // namespace fingertip
