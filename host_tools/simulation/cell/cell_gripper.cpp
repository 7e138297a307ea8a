// fingertip_cell_gripper: serves a simulated gripper on a port of its own, in real time.
#include "libfingertip/text.hpp"
#include "simulation/cell/gripper_server.hpp"
#include "tool/advice.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

using namespace fingertip;

namespace {

volatile std::sig_atomic_t interrupted = 0;

struct Options {
  GripperServer::Options server;
  LineTrouble trouble;
  double object_mm = 0, stiffness_N_mm = 10;
  int fault = 0;
};

int serve(const Options &options) {
  GripperMotion motion(GripperServer::mechanics(options.server.model));
  if (options.object_mm > 0) {
    motion.blocked_at = [&](double width_mm, double force_N) {
      return force_N > 0 && width_mm < options.object_mm && (options.object_mm - width_mm) * options.stiffness_N_mm >= force_N;
    };
  }
  GripperServer server(motion, options.server);
  server.trouble(options.trouble);
  server.fail(static_cast<std::uint8_t>(options.fault));
  std::printf("%s\n", server.port().c_str());
  std::fflush(stdout);
  while (!interrupted) {
    server.step(std::chrono::milliseconds(100));
  }
  return 0;
}

} // namespace

int main(int argc, char **argv) {
  CLI::App app("Serves a simulated gripper with its own protocol; prints its port. Ctrl-C ends it.", "fingertip_cell_gripper");
  Options options;
  const auto models = texts_of(gripper_models(), [](const GripperTraits &one) { return one.model; });
  app.add_option("--model", options.server.model, "Which one")->required()->check(CLI::IsMember(models));
  app.add_option("--slave", options.server.slave, "Its address on the line; else the usual")->check(CLI::Range(1, 253));
  app.add_option("--link", options.server.link, "A name for the port, as long as it is served")->type_name("PATH");
  const auto add = [&](const char *name, auto &value, const char *unit, const char *help) {
    return app.add_option(name, value, help)->type_name(unit);
  };
  add("--object", options.object_mm, "MM", "An object of this width lies between its fingers")->check(CLI::PositiveNumber);
  add("--stiffness", options.stiffness_N_mm, "NUMBER", "How it pushes back, in N/mm")->check(CLI::PositiveNumber)->capture_default_str();
  add("--line", options.trouble.fault, "FAULT", "What befalls each answer")->transform(CLI::CheckedTransformer(line_faults()));
  app.add_option("--fault", options.fault, "The gripper's own, by the maker's code")->type_name("CODE")->check(CLI::Range(0, 255));
  CLI11_PARSE(app, argc, argv);
  for (int signal : {SIGINT, SIGTERM}) {
    std::signal(signal, [](int) { interrupted = 1; });
  }
  try {
    return serve(options);
  } catch (const Error &error) {
    print_error("fingertip_cell_gripper", error);
    return 1;
  }
}
