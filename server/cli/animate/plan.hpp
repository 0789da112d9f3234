// Arguments of animate -> what each picture shows, and where it goes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/picture.hpp"
#include "server/frame/frame.hpp"
#include "server/movie/container.hpp"
#include "server/movie/motion.hpp"

namespace windsplat::cli {

struct AnimateArguments {
  ViewArguments view;
  std::string steps;
  std::string output;
  std::string format;  // empty: by the name of the output
  std::string report;  // empty: no report
  std::string path;    // a file; empty: none
  std::optional<int> per_step;
  std::optional<int> frames;
  std::optional<double> fps;
  std::optional<double> turn;  // degrees
  unsigned threads = 0;
};

// "A:B" or "A:B:S". Empty: malformed.
std::optional<protocol::StepRange> parse_steps(std::string_view text);

// A file name pattern with a zero-padded number.
struct Pattern {
  std::string before;
  std::string after;
  std::size_t digits = 0;

  [[nodiscard]] std::string name(int number) const;
};
// Exactly one %d or %04d or the like; %% is a percent sign. Empty: malformed.
std::optional<Pattern> parse_pattern(std::string_view text);

// Either numbered pictures or a movie.
struct Target {
  std::optional<Pattern> pattern;
  frame::Format format = frame::Format::jpeg;  // of pictures
  std::optional<movie::Container> container;   // of a movie
};
// Errors: invalid for an output that is neither, and a format that its name contradicts.
Result<Target> target_of(const AnimateArguments& arguments);

struct Plan {
  Target target;
  movie::Motion motion;
};

// Errors: malformed or invalid for each option that is not valid or has no effect; those of reading
// the path.
Result<Plan> plan_of(const AnimateArguments& arguments, Target target,
                     const std::vector<Panel>& panels);

}  // namespace windsplat::cli
