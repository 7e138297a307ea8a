/* Commands that are programs of their own, which take this one's place. */
#include "libfingertip/error.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/installed_files.hpp"

#include <cstdlib>

namespace fingertip {

using Words = std::vector<std::string>;

/* The tool links no simulation. */
static int simulate(Words options) {
  const auto program =
      find_installed({"../" FINGERTIP_LIBEXECDIR "/fingertip/fingertip-simulate", "../../simulation/cell/fingertip-simulate"});
  if (!program) {
    throw Error("the program that simulates is not installed; install all of the tool, or build the target fingertip "
                "in the project's tree");
  }
  become(program->string(), options);
}

void run_in_package(const std::string &name, Words options) {
  const auto package = find_installed({"../share/fingertip/python", "python"});
  if (!package) {
    throw Error("the Python package is not installed; install all of the tool, or build the target fingertip in the "
                "project's tree");
  }
  setenv("FINGERTIP_TOOL", this_program().c_str(), 0);
  options.insert(options.begin(), {package->string(), name});
  become("python3", options, name + " needs Python: sudo apt install python3 python3-numpy python3-serial");
}
static int validate(Words options) { run_in_package("validate", std::move(options)); }
static int fit(Words options) { run_in_package("fit", std::move(options)); }

static void add_program(CommandLine &line, const std::string &name, const std::string &help, int (*run)(Words)) {
  auto command = std::make_shared<CLI::App *>();
  *command = line.add(name, help, [command, run] { return run((*command)->remaining()); });
  (*command)->set_help_flag();
  (*command)->prefix_command();
}

void add_simulate(CommandLine &line) {
  add_program(line, "simulate", "Simulate fingertips, which every program finds as it finds real ones, until Ctrl-C", simulate);
}

void add_fit(CommandLine &line) {
  add_program(line, "fit", "Fit pressures of any array that are in a file, by the firmware's own code", fit);
}

void add_validate(CommandLine &line) {
  add_program(line, "validate", "Make a pad's report card in ten minutes, with one weight and a printed template", validate);
}

} // namespace fingertip
