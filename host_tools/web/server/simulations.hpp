/* Lets the page reach the fingertips of `fingertip simulate`, which no browser finds: their ports
 * are pseudo-terminals. Simulated ones only; real ones stay the browser's own affair.
 *
 *   GET  /simulated                        [{"serial": ..., "hand": true}]; hand: one is obeyed (--mouse)
 *   GET  /simulated/line?serial=&client=   the fingertip's packets, without end
 *   POST /simulated/line?client=           bytes for the fingertip
 *   POST /simulated/hand?client=           "press X_mm Y_mm FORCE_N", "lift" or nothing; the answer is what is true:
 *                                          {"t_us", "x_mm", "y_mm", "force_N", "qx_N", "qy_N"}, or {} before it is
 * known
 *
 * client: 8 to 32 hexadecimal digits of the page's own, new for each line. A client is gone when its line is, and what its hand pressed is
 * lifted then. A request that another site makes is refused with 403. Errors are one sentence, of status 4xx. */
#pragma once

#include "web/server/http_server.hpp"

#include <map>
#include <memory>
#include <string>

namespace fingertip {

class Simulations {
public:
  static constexpr const char *PATH = "/simulated";
  static constexpr std::size_t MOST_LINES = 16;

  /* Of a path for which is_for is true. */
  HttpAnswer answer(const HttpRequest &request);
  static bool is_for(const std::string &path);
  /* Whether the page itself asks, or no browser. */
  static bool is_from_page(const HttpRequest &request);

private:
  class Session;
  class Line;

  HttpAnswer open_line(const HttpRequest &request);

  std::map<std::string, std::shared_ptr<Session>> sessions_; /* by client */
};

} // namespace fingertip
