// Values as JSON text, for the page.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip::web {

class Json {
public:
  Json &begin() { return open('{'); }
  Json &end() { return close('}'); }
  Json &begin_list() { return open('['); }
  Json &end_list() { return close(']'); }
  // The name of the value that follows.
  Json &name(std::string_view name) {
    quoted(name);
    text_ += ':';
    first_ = true;
    return *this;
  }
  Json &value(std::string_view text) {
    quoted(text);
    return *this;
  }
  Json &value(bool truth) { return bare(truth ? "true" : "false"); }
  // null where it is not finite, which JSON has not.
  Json &value(double number);
  template <typename Values> Json &list(const Values &values) {
    begin_list();
    for (const auto &one : values) {
      value(static_cast<double>(one));
    }
    return end_list();
  }
  template <typename Value> Json &field(std::string_view key, const Value &content) { return name(key).value(content); }
  Json &null() { return bare("null"); }
  const std::string &text() const { return text_; }

private:
  void separate() {
    if (!first_) {
      text_ += ',';
    }
    first_ = false;
  }
  Json &open(char bracket) {
    separate();
    text_ += bracket;
    first_ = true;
    return *this;
  }
  Json &close(char bracket) {
    text_ += bracket;
    first_ = false;
    return *this;
  }
  Json &bare(std::string_view text) {
    separate();
    text_ += text;
    return *this;
  }
  void quoted(std::string_view text);

  std::string text_;
  bool first_ = true;
};

} // namespace fingertip::web
