/* Files that the tools write. They replace a file only if that is allowed, and never one that is being read. They throw Error. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace fingertip {

/* Where the bytes of a recording go: a file, or a program's own memory. */
class ByteSink {
public:
  virtual ~ByteSink() = default;

  /* All of them or none, and then it throws Error; where they wait to be written, a later call does. */
  virtual void append(const void *bytes, std::size_t length) = 0;
  /* Last of all. */
  virtual void finish() = 0;
  /* The name for messages. */
  virtual const std::string &path() const = 0;
};

/* Throws unless an OutputFile can be made of these; touches nothing. */
void check_output(const std::string &path, bool replace);

/* Whether both paths lead, or would lead once written, to one file. */
bool is_same_file(const std::string &a, const std::string &b);

/* A file that holds nothing but complete appends, even when the disk is full. */
class OutputFile : public ByteSink {
public:
  enum class Appears {
    at_once,           /* and grows: what append returned for outlives a killed program */
    when_finished,     /* whole, in one step; until then, and without finish, an older file stays */
    on_standard_output /* no file: the path only names it in messages */
  };

  /* replace: whether an existing file may go. Devices and pipes are written to at once. */
  OutputFile(const std::string &path, bool replace, Appears appears);
  ~OutputFile() override;
  OutputFile(const OutputFile &) = delete;
  OutputFile &operator=(const OutputFile &) = delete;

  /* On an error a file is cut back to its previous content. Output that is no longer read from
   * standard output is dropped without a message. */
  void append(const void *bytes, std::size_t length) override;
  void finish() override;
  const std::string &path() const override { return path_; }

private:
  std::string path_;
  bool replace_;
  bool to_standard_output_;
  std::string target_;    /* path_ without symbolic links */
  std::string temporary_; /* beside the target, until finished; empty if written at once */
  int fd_;
  bool is_new_ = false; /* written at once, where there was no file: none is left where nothing could be written */
  std::int64_t length_ = 0;
};

} // namespace fingertip
