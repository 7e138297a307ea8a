// served_gripper: serves a simulated gripper on a port of its own, which it prints.
#include "simulation/cell/gripper_server.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

using namespace fingertip;

static volatile std::sig_atomic_t interrupted = 0;

int main(int argc, char **argv) {
  CLI::App app;
  GripperServer::Options options;
  LineTrouble trouble;
  double object_mm = 0, stiffness_N_mm = 10;
  int fault = 0;
  app.add_option("--model", options.model)->required();
  app.add_option("--slave", options.slave);
  app.add_option("--link", options.link, "A name for the port, as long as it is served");
  app.add_option("--object", object_mm, "mm: an object of this width lies between its fingers");
  app.add_option("--stiffness", stiffness_N_mm, "N/mm: of the object");
  app.add_option("--line", trouble.fault, "What befalls each answer")->transform(CLI::CheckedTransformer(line_faults()));
  app.add_option("--fault", fault, "The gripper's own, by the maker's code");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  GripperMotion motion(GripperServer::mechanics(options.model));
  if (object_mm > 0) {
    motion.blocked_at = [&](double width_mm, double force_N) {
      return force_N > 0 && width_mm < object_mm && (object_mm - width_mm) * stiffness_N_mm >= force_N;
    };
  }
  GripperServer server(motion, options);
  server.trouble(trouble);
  server.fail(static_cast<std::uint8_t>(fault));
  std::printf("%s\n", server.port().c_str());
  std::fflush(stdout);
  while (!interrupted) {
    server.step(std::chrono::milliseconds(100));
  }
}
