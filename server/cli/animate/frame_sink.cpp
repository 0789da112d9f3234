#include "server/cli/animate/frame_sink.hpp"

#include <unistd.h>

#include <utility>

#include "server/cli/command.hpp"
#include "server/movie/ffmpeg.hpp"

namespace windsplat::cli {

Result<FrameSink> FrameSink::of(const Plan& plan, std::string output, const CancelToken& cancel) {
  const auto& container = plan.target.container;
  if (container) {
    if (auto found = movie::check_encoder(*container); !found) return found.error();
  }
  return FrameSink(plan, std::move(output), cancel);
}

frame::Encoding FrameSink::encoding(const ViewArguments& arguments) const {
  const Target& target = plan_->target;
  frame::Encoding out =
      file_encoding(target.container ? frame::Format::png : target.format, arguments);
  out.raw = target.container.has_value();
  return out;
}

Result<void> FrameSink::add(int frame, const Sheet& sheet) {
  const Target& target = plan_->target;
  if (!target.container) return write_output(target.pattern->name(frame), sheet.bytes);
  if (!movie_) {
    movie::Options options;
    options.container = *target.container;
    options.width = sheet.width;
    options.height = sheet.height;
    options.fps = plan_->motion.fps();
    auto opened = is_stdout(output_) ? movie::Writer::open(STDOUT_FILENO, options, cancel_)
                                     : movie::Writer::open(output_, options, cancel_);
    if (!opened) return opened.error();
    movie_ = std::move(*opened);
  }
  return movie_->add(sheet.bytes);
}

Result<void> FrameSink::finish() { return movie_ ? movie_->finish() : Result<void>(); }

}  // namespace windsplat::cli
