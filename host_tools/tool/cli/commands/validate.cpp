#include "libfingertip/error.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/installed_files.hpp"

#include <cstdlib>

namespace fingertip {

namespace {

/* The evaluator of a pad is in the Python package, which asks this program for the gains. */
int validate(const std::vector<std::string> &options) {
  const auto package = find_installed({"../share/fingertip/python", "python"});
  if (!package) {
    throw Error("the package that validates is not installed; install all of the tool, or build the target fingertip "
                "in the project's tree");
  }
  setenv("FINGERTIP_TOOL", this_program().c_str(), 0);
  std::vector<std::string> arguments = {package->string(), "validate"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  become("python3", arguments, "validate needs Python: sudo apt install python3 python3-numpy python3-serial");
}

} // namespace

void add_validate(CommandLine &line) {
  auto command = std::make_shared<CLI::App *>();
  *command = line.add("validate", "Make a pad's report card in ten minutes, with one weight and a printed template",
                      [command] { return validate((*command)->remaining()); });
  (*command)->set_help_flag();
  (*command)->prefix_command();
}

} // namespace fingertip
