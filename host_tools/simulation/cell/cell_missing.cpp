// Where MuJoCo was not there when this was built.
#include "libfingertip/error.hpp"
#include "simulation/cell/cell.hpp"

namespace fingertip::cell {

struct Cell::World {};

Cell::Cell(const KindOfGrasp &) {
  throw Error("this program was built without MuJoCo, which has the objects of grasps; put the wheel of "
              "cmake/mujoco.txt into build/mujoco, as "
              "`sh cmake/bootstrap.sh` does, and build again");
}
Cell::~Cell() = default;
void Cell::run(double, double, const KindOfGrasp::Inputs &) {}
double Cell::force_N(std::size_t) const { return 0.0; }
double Cell::force_at_N(double) const { return 0.0; }
Vector Cell::load_N(std::size_t) const { return {}; }
Vector Cell::way_mm() const { return {}; }
double Cell::turned_rad() const { return 0.0; }
bool Cell::slips() const { return false; }
double Cell::slid_mm() const { return 0.0; }
double Cell::friction(std::size_t) const { return 0.0; }
Patch Cell::patch(std::size_t) const { return {}; }

} // namespace fingertip::cell
