/* Where the lines of a recording go: a CSV file, or an MCAP file (mcap_recording.hpp) if its name ends with .mcap. */
#pragma once

#include "libfingertip/output_file.hpp"

#include <memory>
#include <string>

namespace fingertip {

class LineSink {
public:
  virtual ~LineSink() = default;

  /* Writes a line, given without its end. Throws Error if the disk is full, or the file cannot hold it. */
  virtual void line(const std::string &text) = 0;
  /* Call it before the first line: an MCAP file then has wrench, location and pressures of each row. */
  virtual void repeat_every_row() {}
  /* Last of all. */
  virtual void finish() = 0;
  virtual const std::string &path() const = 0;
};

/* What the bytes of a CSV or an MCAP file go to. */
std::unique_ptr<LineSink> make_lines(std::unique_ptr<ByteSink> bytes, bool as_mcap);

bool is_mcap_name(const std::string &path);

/* Throws Error as OutputFile does. */
std::unique_ptr<LineSink> make_lines(const std::string &path, bool replace, OutputFile::Appears appears);

} // namespace fingertip
