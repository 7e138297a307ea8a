/* The part of HTTP/1.1 that a page needs, in one thread that waits in poll(2). What a peer may use is bounded here:
 *
 *   a request      HEAD_BYTES of head, BODY_BYTES of body, of a length that it states; 10 s from its first byte
 *   connections    MOST_CONNECTIONS, MOST_OF_A_PEER from one address; one more takes the place of
 *                  the oldest that waits for a request, else for an answer, so that silent ones keep no one out
 *   an answer      as long as its reader takes something within 60 s; within 10 s of one without end (Stream)
 *
 * Memory: at most MOST_CONNECTIONS * (HEAD_BYTES + BODY_BYTES) = 21 MB, files apart, which are sent from where they are. A fault of a
 * request is answered (400, 411, 413, 431, 505) and its connection ends. An exception of the handler is answered (500) and printed. */
#pragma once

#include "libfingertip/clock.hpp"

#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <poll.h>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

struct HttpRequest {
  std::string method, path, query, body;      /* path and query as they came */
  std::map<std::string, std::string> headers; /* by names in small letters */
  int fd = -1;                                /* of its connection */

  std::string header(const std::string &name) const;
  std::string parameter(const std::string &name) const; /* of the query; "": it is not there */
  /* Whether the kernel knows the other end as a program of this user, or of root, on this machine. */
  bool is_of_this_user() const;
};

struct HttpAnswer {
  /* Bytes without end, for one client. */
  class Stream {
  public:
    virtual ~Stream() = default;
    virtual std::vector<pollfd> poll_descriptors() const = 0;
    /* Appends what has come; false: it is over. Never waits. */
    virtual bool read(std::string *bytes) = 0;
  };

  explicit HttpAnswer(int status_ = 200, std::string text_ = "", std::string type_ = "text/plain; charset=utf-8")
      : status(status_), text(std::move(text_)), type(std::move(type_)) {}

  int status;
  std::string text, type;
  const std::string *file = nullptr; /* instead of text; it outlives the server */
  std::unique_ptr<Stream> stream;    /* instead of both */
  std::string header;                /* one more, or none: "Allow: GET\r\n" */
};

class HttpServer {
public:
  static constexpr std::size_t HEAD_BYTES = 16384, BODY_BYTES = 65536, MOST_CONNECTIONS = 256, MOST_OF_A_PEER = 128;
  using Handler = std::function<HttpAnswer(const HttpRequest &)>;

  /* Listens from now on. port 0: any that is free. headers: of every answer. Throws std::system_error, with
   * std::errc::address_not_available for an address that this machine does not have. */
  HttpServer(const std::string &address, unsigned port, std::string headers);
  ~HttpServer();

  unsigned port() const { return port_; }
  void serve(const Handler &handler, const std::function<bool()> &is_over);

private:
  class Connection;

  void accept_all();

  std::string headers_;
  int listening_ = -1;
  unsigned port_ = 0;
  std::list<Connection> connections_; /* the oldest first */
};

} // namespace fingertip
