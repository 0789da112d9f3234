// Headers of GRIB messages that differ from an earlier one only in their times, pressure or number
// of a hybrid level: these need no decoding by ecCodes, which takes about a millisecond.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/data/formats/grib/fields.hpp"

namespace windsplat::data::grib {

class HeaderCache {
 public:
  // head: the bytes of a message from "GRIB" to the end of the definition of the product (edition
  // 2, section 4) or of the grid (edition 1, section 2). The header of the message; none if it does
  // not follow from one remembered. Known: instants of both editions, and of edition 2 statistics
  // over one range of time, in units of minutes to days.
  [[nodiscard]] std::optional<Header> find(int edition,
                                           const std::vector<unsigned char>& head) const;
  // Does nothing if the times or the level of the header are not those of the head, or beyond a
  // limit of memory.
  void remember(int edition, const std::vector<unsigned char>& head, const Header& header);

 private:
  struct Known {
    Header header;
    double range_hours = 0;  // from the step to the time of validity
  };
  std::unordered_map<std::string, Known> known_;  // by the bytes of the head without these
  std::size_t bytes_ = 0;
};

}  // namespace windsplat::data::grib
