#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/installed_files.hpp"
#include "tool/plain_help.hpp"
#include "web/server/page_server.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

namespace fingertip {

namespace {

struct WebOptions {
  std::string address = "127.0.0.1";
  unsigned port = 8109; /* the same each time: a browser remembers for each port which fingertips a
                           page may use */
  bool no_browser = false;
};

/* Whether there is a desktop whose browser was asked to. */
bool opens(const std::string &url) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) {
    return false;
  }
  /* It may run as long as the browser, and is not this program's to wait for. */
  std::string opener = "xdg-open \"$1\" > /dev/null 2>&1 < /dev/null &";
  std::string words[] = {"sh", "-c", "command -v xdg-open > /dev/null && { " + opener + " }", "sh", url};
  char *arguments[] = {words[0].data(), words[1].data(), words[2].data(), words[3].data(), words[4].data(), nullptr};
  pid_t shell = 0;
  int status = 1;
  const bool begun = posix_spawnp(&shell, "sh", nullptr, nullptr, arguments, environ) == 0;
  while (begun && waitpid(shell, &status, 0) < 0 && errno == EINTR) {
  }
  return status == 0;
}

int web(const WebOptions &options) {
  if (const std::string note = page_note(FINGERTIP_VERSION); !note.empty()) {
    std::fprintf(stderr, "%s\n", note.c_str());
  }
  PageServer server(page_folder(), options.address, options.port);
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  if (!is_loopback(options.address)) {
    std::fprintf(stderr,
                 "everyone who reaches %s may read the page; browsers of other machines give it no fingertips, only "
                 "its simulated one\n",
                 printable(options.address).c_str());
  }
  bool is_open = !options.no_browser && opens(server.url());
  std::fprintf(stderr, "%s; Ctrl-C ends\n", is_open ? "opening it in the browser" : "open it in Chromium, Chrome or Edge, from 89 on");
  server.serve(stop_requested);
  return 0;
}

} // namespace

void add_web(CommandLine &line) {
  auto options = std::make_shared<WebOptions>();
  CLI::App *command =
      line.add("web", "Serve the page that shows and operates fingertips in a browser, until Ctrl-C", [options] { return web(*options); });
  command->add_option("--port", options->port, "TCP port; 0: any that is free; default 8109")->check(within(0, 65535))->type_name("N");
  with_value(command, "ADDRESS", "--address", options->address, "Address to listen on; default 127.0.0.1: this machine only");
  command->add_flag("--no-browser", options->no_browser, "Only print the address, do not open it");
}

} // namespace fingertip
