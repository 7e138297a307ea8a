/* Serves the built page to browsers, and to those of this machine its simulated fingertips (simulations.hpp). Nothing else: the page's
 * files are read once, a name is searched among them and never becomes a path. The page may load nothing from elsewhere
 * (Content-Security-Policy), no other site may embed or read it, and it is given only to who asks for it by an address or as
 * localhost: a name of the asker's own that leads here (DNS rebinding) is refused with 421.
 *
 * Everyone on this machine may read the page. Simulated fingertips are given to who has the token, which each server
 * makes at its start: as a parameter of the request, or as the cookie that the page gets with it. Other users may see
 * it where a browser is started with it, so they are refused even then.
 *
 * Memory: the page's, some megabytes, and what http_server.hpp allows its clients. Errors: Error, of a folder that
 * cannot be read and an address that cannot be had. */
#pragma once

#include "web/server/http_server.hpp"
#include "web/server/simulations.hpp"

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace fingertip {

class PageServer {
public:
  /* port 0: any that is free. Listens when this returns; answers in serve. */
  PageServer(const std::filesystem::path &folder, const std::string &address, unsigned port);

  /* For the browser: http://127.0.0.1:8109/?token=...; no token where it passes on no fingertips */
  const std::string &url() const { return url_; }

  /* Until is_over is true, which is asked every 50 ms. */
  void serve(const std::function<bool()> &is_over);

private:
  HttpAnswer answer(const HttpRequest &request);

  struct File {
    std::string type;
    std::string bytes;
  };

  std::map<std::string, File> files_; /* by the path of the request: /index.html */
  std::string url_, token_;
  std::unique_ptr<Simulations> simulations_; /* of a server that only this machine reaches */
  std::unique_ptr<HttpServer> server_;
};

/* Whether only this machine reaches it: 127.0.0.0/8, ::1, localhost. */
bool is_loopback(const std::string &address);

} // namespace fingertip
