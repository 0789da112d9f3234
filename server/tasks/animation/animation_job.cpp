#include "server/tasks/animation/animation_job.hpp"

#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <system_error>
#include <utility>

#include "protocol/animation/limits.hpp"
#include "protocol/codec.hpp"
#include "protocol/utc_time.hpp"
#include "server/data/model/digest.hpp"
#include "server/frame/frame.hpp"
#include "server/movie/output.hpp"
#include "server/movie/writer.hpp"
#include "server/tasks/animation/animations.hpp"
#include "server/tasks/animation/background.hpp"
#include "server/tasks/drawing.hpp"

namespace windsplat::tasks {
namespace {

constexpr unsigned encoder_threads = 1;  // pictures of other clients need the others

frame::Encoding encoding_of_pictures() {
  frame::Encoding encoding;
  encoding.format = frame::Format::png;
  encoding.raw = true;
  return encoding;
}

Result<PreparedPtr> prepare(Backend& backend, const AnimationWork& work, const protocol::View& view,
                            const CancelToken& cancel) {
  return backend.catalogue.load(
      *work.dataset,
      [&](data::Dataset& dataset) -> Result<PreparedPtr> {
        const auto completed = frame::complete(view, dataset);
        if (!completed) return with_dataset_name(completed.error(), dataset.info().id);
        return prepare_picture(*completed, frame::own_setting(*completed), encoding_of_pictures(),
                               dataset, Loading::allowed);
      },
      cancel);
}

// The pixels of a view: 8-bit sRGB.
Result<image::Bytes> draw(Backend& backend, const AnimationWork& work, const protocol::View& view,
                          BackgroundOwner& owner, const CancelToken& cancel) {
  const auto prepared = prepare(backend, work, view, cancel);
  if (!prepared) return prepared.error();
  const auto drawn = std::make_shared<image::Bytes>();
  const auto done = in_background(
      backend.renderer, owner, cancel,
      [&backend, drawn, picture = *prepared,
       dataset = work.dataset](const CancelToken& stop) -> Result<void> {
        data::Dataset resident = dataset->resident_only();
        auto frame = frame::produce(picture->frame, resident, *backend.pool, stop, backend.frames);
        if (!frame) return frame.error();
        *drawn = std::move(frame->bytes);
        return {};
      });
  if (!done) return done.error();
  return std::move(*drawn);
}

Result<std::int64_t> size_of(const data::Descriptor& file) {
  struct stat about {};
  if (::fstat(file.number(), &about) != 0) {
    return make_error(ErrorKind::internal, std::generic_category().message(errno));
  }
  if (about.st_size <= protocol::limits::animation_bytes_max)
    return static_cast<std::int64_t>(about.st_size);
  return make_error(ErrorKind::too_large,
                    "an animation has at most " +
                        std::to_string(protocol::limits::animation_bytes_max >> 20) +
                        " MiB; choose fewer or smaller pictures, or mp4 in place of zip");
}

// The error of picture n; where the time is over it names the limit.
Error with_time(Error error, const BackgroundOwner& owner, int n, int frames) {
  const bool late = error.kind == ErrorKind::busy && BackgroundOwner::Clock::now() >= *owner.until;
  if (!late) return error;
  error.message = "an animation is drawn for at most " +
                  std::to_string(static_cast<int>(Animations::render_s_max)) + " s, and " +
                  std::to_string(n) + " of " + std::to_string(frames) +
                  " pictures are drawn; choose fewer or smaller ones, or try again when the server "
                  "is less busy";
  return error;
}

Result<std::int64_t> write_frames(Backend& backend, const AnimationWork& work,
                                  const Jobs::Handle& handle, const data::Descriptor& file) {
  const movie::Motion& motion = work.motion;
  movie::Options options;
  options.container = work.format;
  options.width = work.view.image.width;
  options.height = work.view.image.height;
  options.fps = motion.fps();
  options.threads = encoder_threads;
  const auto writer = movie::Writer::open_in_place(file.number(), options, handle.cancel);
  if (!writer) return writer.error();
  const auto base = motion.base(work.view, work.view, [&](const protocol::View& view) {
    return backend.catalogue.load(
        *work.dataset, [&](data::Dataset& dataset) { return frame::complete(view, dataset); },
        handle.cancel);
  });
  if (!base) return base.error();
  constexpr std::chrono::seconds time_max(static_cast<std::int64_t>(Animations::render_s_max));
  BackgroundOwner owner{backend.references.next_owner(), work.payer, work.picture_ms,
                        BackgroundOwner::Clock::now() + time_max};
  for (int n = 0; n < motion.frames(); ++n) {
    const auto view = motion.view_of(n, work.view, *base);
    if (!view) return view.error();
    const auto pixels = draw(backend, work, *view, owner, handle.cancel);
    if (!pixels) return with_time(pixels.error(), owner, n, motion.frames());
    if (auto added = (*writer)->add(*pixels); !added) return added.error();
    if (auto fits = size_of(file); !fits) return fits;
    handle.report_progress((n + 1.0) / motion.frames());
  }
  if (auto finished = (*writer)->finish(); !finished) return finished.error();
  return size_of(file);
}

// ASCII, without signs that have a meaning in names of files or in a header.
std::string file_name_of(const std::string& dataset, std::string_view ending) {
  std::string out;
  for (const char c : dataset.substr(0, 60)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    out += plain || c == '-' || (c == '.' && !out.empty()) ? c : '_';
  }
  return (out + '.').append(ending);
}

// All inputs that determine the file.
std::string id_of(const AnimationWork& work) {
  const std::string text = work.text + '\n' + work.dataset->digest() + '\n' + WINDSPLAT_VERSION;
  const std::string first = data::digest_of(text);
  return first + data::digest_of(first + text);
}

}  // namespace

Result<protocol::JobResult> draw_animation(Backend& backend, const AnimationWork& work,
                                           const Jobs::Handle& handle) {
  const std::string id = id_of(work);
  if (const auto kept = backend.animations.find(id)) return kept->description;
  const data::Descriptor file = movie::unnamed_file();
  if (!file) {
    return make_error(ErrorKind::internal, "there is no room for temporary files: " +
                                               std::generic_category().message(errno));
  }
  const auto bytes = write_frames(backend, work, handle, file);
  if (!bytes) return bytes.error();
  auto mapped = MappedFile::of(file);
  if (!mapped) return mapped.error();
  const std::string_view ending = movie::name_of(work.format);
  protocol::AnimationDescription description;
  description.id = id;
  description.movie =
      work.base_path + "v1/animations/" + description.id + '.' + std::string(ending);
  description.format = ending;
  description.width = work.view.image.width;
  description.height = work.view.image.height;
  description.frames = work.motion.frames();
  description.fps = work.motion.fps();
  description.bytes = *bytes;
  description.expires = protocol::utc_text(std::time(nullptr) + Animations::lasts.count());
  backend.animations.keep(
      {description, file_name_of(work.dataset->info().id, ending), std::move(*mapped)});
  return protocol::JobResult(std::move(description));
}

}  // namespace windsplat::tasks
