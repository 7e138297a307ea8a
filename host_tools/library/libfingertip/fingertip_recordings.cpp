/* Recordings of fingertip.h: bytes that are fed instead of read, and taken instead of written. */
#include "libfingertip/fingertip_values.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/mcap.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/recording_writer.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

using namespace fingertip;
using namespace fingertip::values;

namespace {

/* An exception through a reader that needs bytes which were not fed yet; its next call begins again. */
struct NotYet {};

/* The part of a file that was fed and is still needed. */
class Window {
public:
  explicit Window(std::uint64_t size) : size_(size) {}

  void feed(const std::uint8_t *bytes, std::size_t length) {
    bytes_.erase(0, std::exchange(done_, 0));
    bytes_.append(reinterpret_cast<const char *>(bytes), length);
  }

  std::string_view all() const { return std::string_view(bytes_).substr(done_); }
  std::uint64_t begin() const { return begin_; }
  std::uint64_t size() const { return std::max(size_, end()); }
  std::uint64_t end() const { return begin_ + all().size(); }
  bool is_whole() const { return end() >= size_; }

  /* What comes before is not needed now. */
  void go_to(std::uint64_t at) {
    if (at < begin_ || at > end()) {
      bytes_.clear();
      done_ = 0;
    } else {
      done_ += static_cast<std::size_t>(at - begin_);
    }
    begin_ = at;
  }

private:
  std::string bytes_;
  std::size_t done_ = 0;    /* of these */
  std::uint64_t begin_ = 0; /* place of the first that is not done */
  std::uint64_t size_;
};

class FedBytes : public ByteSource {
public:
  explicit FedBytes(Window &window) : window_(window) {}

  std::size_t read(std::uint64_t at, char *to, std::size_t length) override {
    /* A reader goes back by the head of a record at most. */
    const bool is_there = at >= window_.begin() && at <= window_.end();
    window_.go_to(is_there ? std::max(window_.begin(), at - std::min<std::uint64_t>(at, mcap::RECORD_HEAD_BYTES)) : at);
    const std::uint64_t before = at - window_.begin();
    const std::string_view bytes = window_.all();
    if (bytes.size() < before + length && !window_.is_whole()) {
      throw NotYet();
    }
    return before < bytes.size() ? bytes.copy(to, length, static_cast<std::size_t>(before)) : 0;
  }
  std::uint64_t size() const override { return window_.size(); }

private:
  Window &window_;
};

/* The bytes of a file that were not taken yet. */
class MemorySink : public ByteSink {
public:
  explicit MemorySink(std::string &bytes) : bytes_(bytes) {}

  void append(const void *bytes, std::size_t length) override { bytes_.append(static_cast<const char *>(bytes), length); }
  void finish() override {}
  const std::string &path() const override { return name_; }

private:
  std::string &bytes_;
  std::string name_ = "the recording";
};

Metadata metadata_of(const char *comments) {
  Metadata pairs;
  for (std::string_view line : split(comments ? comments : "", '\n')) {
    const std::size_t colon = line.find(": ");
    if (colon != std::string_view::npos) {
      pairs.emplace_back(line.substr(0, colon), line.substr(colon + 2));
    } else if (!line.empty()) {
      throw Error(ErrorCode::wrong_choice, "\"" + std::string(line) + "\" is no \"key: value\"");
    }
  }
  return pairs;
}

std::vector<wire_info> infos_of(const double *infos, std::size_t devices) {
  const std::size_t count = count_of(WIRE_INFO);
  std::vector<wire_info> all;
  for (std::size_t i = 0; infos && i < devices; i++) {
    all.push_back(packet_of(WIRE_INFO, infos + i * count, count).body.info);
  }
  if (all.empty()) {
    throw Error(ErrorCode::wrong_choice, "a recording needs a fingertip");
  }
  return all;
}

} // namespace

struct fingertip_reader {
  fingertip_reader(const char *file, std::uint64_t size, bool skip) : name(file), salvage(skip), window(size) {}

  std::string name;
  bool salvage;
  Window window;
  std::optional<PacketFile> packets;       /* once its first bytes are there */
  std::optional<PacketFile::Item> waiting; /* for a larger buffer */
  std::string event;
};

struct fingertip_writer {
  std::string bytes; /* that wait to be taken */
  std::optional<RecordingWriter> recording;
  std::size_t devices = 1;
};

struct fingertip_reader *fingertip_reader_new(const char *name, uint64_t size, int salvage) {
  fingertip_reader *reader = nullptr;
  (void)guarded([&] {
    reader = new fingertip_reader(name ? name : "", size, salvage != 0);
    return FINGERTIP_OK;
  });
  return reader;
}

void fingertip_reader_free(struct fingertip_reader *reader) { delete reader; }

enum fingertip_status fingertip_reader_feed(struct fingertip_reader *reader, const uint8_t *bytes, size_t length) {
  return guarded([&] {
    if (!reader || (!bytes && length > 0)) {
      return failed(FINGERTIP_ERR_ARGUMENT, "a pointer is NULL");
    }
    reader->window.feed(bytes, length);
    return FINGERTIP_OK;
  });
}

uint64_t fingertip_reader_wants(const struct fingertip_reader *reader) { return reader->window.end(); }

enum fingertip_status fingertip_reader_next(struct fingertip_reader *reader, struct fingertip_item *item, double *values, size_t size,
                                            size_t *count) {
  return guarded([&] {
    if (!reader || !item || !values || !count) {
      return failed(FINGERTIP_ERR_ARGUMENT, "a pointer is NULL");
    }
    auto next = reader->waiting;
    try {
      if (!reader->packets) {
        reader->packets.emplace(reader->name, reader->salvage, std::make_unique<FedBytes>(reader->window));
      }
      next = next ? next : reader->packets->next();
    } catch (const NotYet &) {
      return FINGERTIP_WAIT;
    }
    if (!next) {
      return FINGERTIP_END;
    }
    const bool is_event = next->kind == PacketFile::Item::Kind::event;
    const wire_packet &packet = next->packet;
    const std::size_t needed = is_event ? 0 : count_of(packet.type);
    if (needed > size) {
      reader->waiting = next;
      return failed(FINGERTIP_ERR_ARGUMENT, "there is no room for a packet's numbers");
    }
    reader->waiting.reset();
    reader->event = next->event;
    const bool is_row = !is_event && is_frame(packet);
    item->time_us = is_row ? next->time_us.value_or(static_cast<double>(packet.t_us)) : static_cast<double>(NAN);
    item->device = next->device;
    item->type = is_event ? 0 : packet.type;
    if (!is_event) {
      put(packet, values);
    }
    *count = needed;
    return FINGERTIP_OK;
  });
}

const char *fingertip_reader_event(const struct fingertip_reader *reader) { return reader->event.c_str(); }

int fingertip_reader_is_capture(const struct fingertip_reader *reader) { return reader->packets && !reader->packets->recording(); }

int fingertip_reader_has_end(const struct fingertip_reader *reader) { return reader->packets && reader->packets->has_end(); }

uint64_t fingertip_reader_skipped(const struct fingertip_reader *reader) { return reader->packets ? reader->packets->skipped_lines() : 0; }

void fingertip_reader_counts(const struct fingertip_reader *reader, double counts[FINGERTIP_COUNTS]) {
  LineStatistics found;
  if (reader->packets) {
    const RecordingReader *recording = reader->packets->recording();
    found = recording ? recording->end_statistics().value_or(found) : reader->packets->statistics();
  }
  put(found, counts);
}

uint8_t fingertip_reader_other_version(const struct fingertip_reader *reader) {
  return reader->packets ? reader->packets->other_version() : 0;
}

namespace {

template <typename Make> fingertip_writer *made(enum fingertip_format format, Make make) {
  std::unique_ptr<fingertip_writer> writer;
  const auto status = guarded([&] {
    writer = std::make_unique<fingertip_writer>();
    make(*writer, make_lines(std::make_unique<MemorySink>(writer->bytes), format == FINGERTIP_MCAP));
    return FINGERTIP_OK;
  });
  return status == FINGERTIP_OK ? writer.release() : nullptr;
}

/* Runs a writer's call about a device. */
template <typename Body> fingertip_status written(fingertip_writer *writer, std::size_t device, Body body) {
  return guarded([&] {
    if (!writer || device >= writer->devices) {
      return failed(FINGERTIP_ERR_ARGUMENT, "the recording has no such fingertip");
    }
    body();
    return FINGERTIP_OK;
  });
}

} // namespace

struct fingertip_writer *fingertip_writer_new(enum fingertip_format format, const double *info, const char *comments) {
  return made(format, [&](fingertip_writer &writer, std::unique_ptr<LineSink> lines) {
    const wire_info own = infos_of(info, 1)[0];
    writer.recording.emplace(std::move(lines), &own, own.sensor_count, metadata_of(comments), sends_both(own));
  });
}

struct fingertip_writer *fingertip_writer_new_joint(enum fingertip_format format, const double *infos, size_t devices, int64_t host_zero_us,
                                                    const char *comments) {
  return made(format, [&](fingertip_writer &writer, std::unique_ptr<LineSink> lines) {
    const auto all = infos_of(infos, devices);
    writer.devices = devices;
    writer.recording.emplace(std::move(lines), all, metadata_of(comments), host_zero_us, sends_both(all[0]));
  });
}

void fingertip_writer_free(struct fingertip_writer *writer) { delete writer; }

enum fingertip_status fingertip_writer_packet(struct fingertip_writer *writer, size_t device, uint8_t type, const double *values,
                                              size_t count, double host_us) {
  return written(writer, device, [&] {
    const wire_packet packet = packet_of(type, values, values ? count : 0);
    writer->recording->packet(device, packet, host_us);
  });
}

enum fingertip_status fingertip_writer_event(struct fingertip_writer *writer, size_t device, const char *text) {
  return written(writer, device, [&] { writer->recording->event(device, printable(text ? text : "")); });
}

enum fingertip_status fingertip_writer_clock(struct fingertip_writer *writer, size_t device, const double estimate[4], unsigned jumps) {
  return written(writer, device, [&] {
    if (estimate) {
      const ClockEstimate now = {static_cast<std::uint64_t>(estimate[0]), estimate[1], estimate[2], estimate[3]};
      writer->recording->clock(device, now, jumps);
    }
  });
}

enum fingertip_status fingertip_writer_settle(struct fingertip_writer *writer, double host_us) {
  return written(writer, 0, [&] { writer->recording->settle(host_us); });
}

enum fingertip_status fingertip_writer_finish(struct fingertip_writer *writer, const char *reason, const double *counts) {
  return written(writer, 0, [&] {
    std::vector<LineStatistics> all(writer->devices);
    for (std::size_t i = 0; counts && i < all.size(); i++) {
      all[i] = statistics_of(counts + i * FINGERTIP_COUNTS);
    }
    writer->recording->finish(all, printable(reason ? reason : ""));
  });
}

uint64_t fingertip_writer_frames(const struct fingertip_writer *writer) { return writer->recording->frames(); }

size_t fingertip_writer_take(struct fingertip_writer *writer, uint8_t *bytes, size_t size) {
  const std::size_t taken = std::min(size, writer->bytes.size());
  std::memcpy(bytes, writer->bytes.data(), taken);
  writer->bytes.erase(0, taken);
  return taken;
}
