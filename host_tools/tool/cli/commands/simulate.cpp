#include "libfingertip/error.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/installed_files.hpp"

namespace fingertip {

namespace {

/* The tool links no simulation: this is a program of its own, which takes this one's place. */
int simulate(const std::vector<std::string> &options) {
  const auto program = find_installed(
      {"../" FINGERTIP_LIBEXECDIR "/fingertip/fingertip-simulate", "../../simulation/cell/fingertip-simulate"});
  if (!program) {
    throw Error("the program that simulates is not installed; install all of the tool, or build "
                "the target fingertip in the project's tree");
  }
  become(program->string(), options);
}

} // namespace

void add_simulate(CommandLine &line) {
  auto command = std::make_shared<CLI::App *>();
  *command = line.add("simulate",
                      "Simulate fingertips, which every program finds as it finds real ones, until "
                      "Ctrl-C",
                      [command] { return simulate((*command)->remaining()); });
  (*command)->set_help_flag();
  (*command)->prefix_command();
}

} // namespace fingertip
