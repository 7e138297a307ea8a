#include "web/server/page_server.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <fstream>
#include <sstream>
#include <sys/random.h>
#include <system_error>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

constexpr const char *POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' "
                               "data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self'; manifest-src 'self'; "
                               "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const std::string HEADERS = std::string("Content-Security-Policy: ") + POLICY +
                            "\r\n"
                            "Permissions-Policy: serial=(self), camera=(), geolocation=(), microphone=()\r\n"
                            "X-Content-Type-Options: nosniff\r\n"
                            "Referrer-Policy: no-referrer\r\n"
                            "Cross-Origin-Opener-Policy: same-origin\r\n"
                            "Cross-Origin-Embedder-Policy: require-corp\r\n"
                            "Cross-Origin-Resource-Policy: same-origin\r\n"
                            "Cache-Control: no-cache\r\n"; /* the next build has the same address */

enum { MISDIRECTED_REQUEST = 421, FORBIDDEN = 403, METHOD_NOT_ALLOWED = 405, NOT_FOUND = 404 };

std::string type_of(const fs::path &file) {
  static const std::map<std::string, std::string> types{
      {".html", "text/html; charset=utf-8"}, {".js", "text/javascript; charset=utf-8"}, {".css", "text/css; charset=utf-8"},
      {".wasm", "application/wasm"},         {".txt", "text/plain; charset=utf-8"},
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

bool has_cookie(const HttpRequest &request, const std::string &cookie) {
  const std::string all = request.header("cookie");
  const std::vector<std::string_view> each = split(all, ';');
  return std::any_of(each.begin(), each.end(), [&](std::string_view one) { return trim(one) == cookie; });
}

std::string new_token() {
  std::vector<std::uint8_t> bytes(16);
  if (getentropy(bytes.data(), bytes.size()) != 0) {
    throw Error("the kernel gives no random bytes");
  }
  return hex(bytes);
}

std::string why_not(const std::string &address, unsigned port, int error) {
  std::string place = "port " + std::to_string(port) + " of " + address;
  switch (error) {
  case EADDRINUSE:
    return place + " is taken by another program; end that one, or choose another --port (a browser asks "
                   "for fingertips again there)";
  case EACCES: return place + " needs privileges; choose another --port, from 1024 on";
  default: return place + " cannot be had (" + std::generic_category().message(error) + "); is it an address of this machine?";
  }
}

} // namespace

bool is_loopback(const std::string &address) {
  in_addr four{};
  in6_addr six{};
  return address == "localhost" || (inet_pton(AF_INET, address.c_str(), &four) == 1 && ntohl(four.s_addr) >> 24 == 127) ||
         (inet_pton(AF_INET6, address.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six));
}

PageServer::PageServer(const fs::path &folder, const std::string &address, unsigned port) {
  std::error_code failed;
  for (fs::recursive_directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->is_regular_file()) {
      files_["/" + entry->path().lexically_relative(folder).generic_string()] = {type_of(entry->path()), content(entry->path())};
    }
  }
  if (failed) {
    throw Error(ErrorCode::cannot_read, folder.string() + ": " + failed.message());
  }
  try {
    server_ = std::make_unique<HttpServer>(address, port, HEADERS);
  } catch (const std::system_error &error) {
    throw Error(why_not(address, port, error.code().value()));
  }
  bool is_six = address.find(':') != std::string::npos;
  url_ = "http://" + (is_six ? "[" + address + "]" : address) + ":" + std::to_string(server_->port()) + "/";
  if (is_loopback(address)) {
    simulations_ = std::make_unique<Simulations>();
    token_ = new_token();
    url_ += "?token=" + token_;
  }
}

HttpAnswer PageServer::answer(const HttpRequest &request) {
  const std::string host = host_of(request.header("host"));
  const std::string cookie = "fingertip-" + std::to_string(server_->port()) + "=" + token_;
  const auto file = files_.find(request.path == "/" ? "/index.html" : request.path);
  HttpAnswer answer;
  const auto refuse = [&](int status, const char *text) {
    answer.status = status;
    answer.text = text;
  };
  if (host != "localhost" && !is_address(host)) {
    refuse(MISDIRECTED_REQUEST, "ask for it by its address\n");
  } else if (simulations_ && Simulations::is_for(request.path)) {
    if (!Simulations::is_from_page(request)) {
      refuse(FORBIDDEN, "only the page itself may ask\n");
    } else if (request.parameter("token") != token_ && !has_cookie(request, cookie)) {
      refuse(FORBIDDEN, "open the address that fingertip web has printed: its token is of that one run\n");
    } else if (!request.is_of_this_user()) {
      refuse(FORBIDDEN, "it is another user's\n");
    } else {
      return simulations_->answer(request);
    }
  } else if (request.method != "GET" && request.method != "HEAD") {
    refuse(METHOD_NOT_ALLOWED, "it is only to be read\n");
    answer.header = "Allow: GET, HEAD\r\n";
  } else if (file == files_.end()) {
    refuse(NOT_FOUND, "the page has no such file\n");
  } else {
    answer.type = file->second.type;
    answer.file = &file->second.bytes;
    if (simulations_ && request.parameter("token") == token_) {
      answer.header = "Set-Cookie: " + cookie + "; Path=" + Simulations::PATH + "; HttpOnly; SameSite=Strict\r\n";
    }
  }
  return answer;
}

void PageServer::serve(const std::function<bool()> &is_over) {
  server_->serve([this](const HttpRequest &request) { return answer(request); }, is_over);
}

} // namespace fingertip
