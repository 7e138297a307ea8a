#include "web/server/page_server.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"

#include <arpa/inet.h>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <httplib.h>
#include <sstream>
#include <thread>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

constexpr const char *POLICY =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' "
    "data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self'; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const httplib::Headers HEADERS{
    {"Content-Security-Policy", POLICY},
    {"Permissions-Policy", "serial=(self), camera=(), geolocation=(), microphone=()"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Embedder-Policy", "require-corp"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cache-Control", "no-cache"}, /* the next build has the same address */
};

constexpr std::chrono::milliseconds LOOK_INTERVAL{50};

/* Lines of simulated fingertips, and as many for all that is short. */
constexpr std::size_t THREADS = 2 * Simulations::MOST_LINES;
constexpr std::size_t MOST_BODY_BYTES = 65536;

enum { MISDIRECTED_REQUEST = 421, FORBIDDEN = 403, METHOD_NOT_ALLOWED = 405, NOT_FOUND = 404 };

std::string type_of(const fs::path &file) {
  static const std::map<std::string, std::string> types{
      {".html", "text/html; charset=utf-8"}, {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},   {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
  };
  auto found = types.find(file.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

std::string content(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in) {
    throw Error(ErrorCode::cannot_read, file.string() + ": cannot read it");
  }
  return bytes.str();
}

/* Without the port: of "[::1]:8109" ::1. */
std::string host_of(const std::string &header) {
  if (!header.empty() && header.front() == '[') {
    return header.substr(1, header.find(']') - 1);
  }
  return header.substr(0, header.find(':'));
}

bool is_address(const std::string &text) {
  in6_addr any{};
  return inet_pton(AF_INET, text.c_str(), &any) == 1 || inet_pton(AF_INET6, text.c_str(), &any) == 1;
}

std::string why_not(const std::string &address, unsigned port) {
  std::string place = "port " + std::to_string(port) + " of " + address;
  switch (errno) {
  case EADDRINUSE:
    return place + " is taken by another program; end that one, or choose another --port (a browser asks "
                   "for fingertips again there)";
  case EACCES:
    return place + " needs privileges; choose another --port, from 1024 on";
  default:
    return place + " cannot be had" + (errno ? std::string(" (") + std::strerror(errno) + ")" : "") +
           "; is it an address of this machine?";
  }
}

} // namespace

bool is_loopback(const std::string &address) {
  in_addr four{};
  in6_addr six{};
  return address == "localhost" ||
         (inet_pton(AF_INET, address.c_str(), &four) == 1 && ntohl(four.s_addr) >> 24 == 127) ||
         (inet_pton(AF_INET6, address.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six));
}

PageServer::PageServer(const fs::path &folder, const std::string &address, unsigned port)
    : server_(std::make_unique<httplib::Server>()) {
  std::error_code failed;
  for (fs::recursive_directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->is_regular_file()) {
      files_["/" + entry->path().lexically_relative(folder).generic_string()] = {type_of(entry->path()),
                                                                                 content(entry->path())};
    }
  }
  if (failed) {
    throw Error(ErrorCode::cannot_read, folder.string() + ": " + failed.message());
  }

  server_->set_default_headers(HEADERS);
  if (is_loopback(address)) {
    simulations_ = std::make_unique<Simulations>();
    simulations_->serve(*server_);
    server_->new_task_queue = [] { return new httplib::ThreadPool(THREADS); };
    server_->set_payload_max_length(MOST_BODY_BYTES);
  }
  /* The library's own would share the port with another server. */
  server_->set_socket_options([](socket_t socket) {
    int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server_->set_pre_routing_handler([this](const httplib::Request &request, httplib::Response &response) {
    std::string host = host_of(request.get_header_value("Host"));
    auto refuse = [&](int status, const char *text) {
      response.status = status;
      response.set_content(text, "text/plain; charset=utf-8");
    };
    auto file = files_.find(request.path == "/" ? "/index.html" : request.path);
    if (host != "localhost" && !is_address(host)) {
      refuse(MISDIRECTED_REQUEST, "ask for it by its address\n");
    } else if (simulations_ && Simulations::is_for(request.path)) {
      if (Simulations::is_from_page(request)) {
        return httplib::Server::HandlerResponse::Unhandled;
      }
      refuse(FORBIDDEN, "only the page itself may ask\n");
    } else if (request.method != "GET" && request.method != "HEAD") {
      response.set_header("Allow", "GET, HEAD");
      refuse(METHOD_NOT_ALLOWED, "it is only to be read\n");
    } else if (file == files_.end()) {
      refuse(NOT_FOUND, "the page has no such file\n");
    } else {
      response.set_content(file->second.bytes, file->second.type);
    }
    return httplib::Server::HandlerResponse::Handled;
  });

  errno = 0;
  int bound = port == 0                                                ? server_->bind_to_any_port(address)
              : server_->bind_to_port(address, static_cast<int>(port)) ? static_cast<int>(port)
                                                                       : -1;
  if (bound < 0) {
    throw Error(why_not(address, port));
  }
  bool is_six = address.find(':') != std::string::npos;
  url_ = "http://" + (is_six ? "[" + address + "]" : address) + ":" + std::to_string(bound) + "/";
}

PageServer::~PageServer() = default;

void PageServer::serve(const std::function<bool()> &is_over) {
  std::thread answering([this] { server_->listen_after_bind(); });
  /* Before it runs, it ignores a stop. */
  while (!is_over() || !server_->is_running()) {
    wait_until(host_now() + LOOK_INTERVAL);
  }
  server_->stop();
  answering.join();
}

} // namespace fingertip
