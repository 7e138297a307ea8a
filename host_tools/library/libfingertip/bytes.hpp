/* Where the bytes of a recording come from, and where they go: a file, or a program's own memory. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace fingertip {

class ByteSource {
public:
  virtual ~ByteSource() = default;

  /* Fewer than length only where the bytes end, or cannot be read. */
  virtual std::size_t read(std::uint64_t at, char *to, std::size_t length) = 0;
  /* The total size. */
  virtual std::uint64_t size() const = 0;
};

class ByteSink {
public:
  virtual ~ByteSink() = default;

  /* All of them or none, and then it throws Error. */
  virtual void append(const void *bytes, std::size_t length) = 0;
  /* Last of all. */
  virtual void finish() = 0;
  /* For messages. */
  virtual const std::string &path() const = 0;
};

} // namespace fingertip
