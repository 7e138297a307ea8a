// Where MuJoCo was not there when this was built.
#include "libfingertip/error.hpp"
#include "simulation/cell/cell.hpp"

namespace fingertip::cell {

std::unique_ptr<Cell> make_cell(const GraspScenario &) {
  throw Error("this program was built without MuJoCo, which has the objects of grasps; put the wheel of "
              "cmake/mujoco.txt into build/mujoco, as "
              "`sh cmake/bootstrap.sh` does, and build again");
}

} // namespace fingertip::cell
