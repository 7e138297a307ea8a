#include "shear/static/tables.hpp"

namespace fingertip::shear {

using nlohmann::ordered_json;

// Pads with a dip, and pads like real ones, each calibrated as it is, beside those of the other
// tables. The touches are the same.
void judge_cast(Bench &bench, ordered_json &out) {
  struct Kind {
    const char *name, *prefix;
    PadOf pad;
  };
  const Kind kinds[] = {{"10 %, calibrated", "", bench.calibrated},
                        {"10 % and a dip, calibrated", "dip_", bench.calibrated_as({truth::DIP})},
                        {"like real ones, calibrated", "cast_", bench.calibrated_as({truth::LIKE_REAL})}};
  for (const Kind &kind : kinds) {
    for (const Load &load : LOADS) {
      Case c = bench.usual();
      c.pad = kind.pad;
      c.share = load.share;
      c.history = load.history;
      c.fewer = 0.5;
      const Results results = bench.run("cast", c);
      ordered_json row = results.row(std::string(kind.name) + ", Q/F " + load.name);
      row["pad"] = kind.name;
      row["load"] = load.share;
      out["by_cast"].push_back(row);
      const std::string prefix = kind.prefix;
      if (!prefix.empty() && load.share == SHARE && load.history == History::held) {
        for (const char *key : {"valid_percent", "ratio_error_p50", "ratio_error_p95", "vector_error_p50",
                                "vector_error_p95", "direction_p90_deg", "q_cover_1sd", "q_cover_2sd"}) {
          out[prefix + key] = row[key];
        }
        out[prefix + "location_loaded_median_mm"] = row["location_p50_mm"];
      }
      if (!prefix.empty() && load.share == 0.0) {
        out[prefix + "location_price_mm"] =
            row["location_p50_mm"].get<double>() - row["location_without_p50_mm"].get<double>();
      }
    }
  }
  bench.progress("pads like those that are cast");
}

} // namespace fingertip::shear
