// Animations: a posted view and its motion become a job that draws a movie; finished movies are
// served as files.
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "protocol/animation/animation.hpp"
#include "protocol/animation/limits.hpp"
#include "server/api/resources.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/movie/container.hpp"
#include "server/movie/ffmpeg.hpp"
#include "server/movie/motion.hpp"
#include "server/tasks/animation/animation_job.hpp"

namespace windsplat::api {
namespace {

using tasks::Animations;
namespace limits = protocol::limits;

// An error of a view as that of the document that contains it.
Error in_view(Error error) {
  if (!error.at.empty()) error.message = "/view" + error.message;
  for (FieldError& each : error.at) each.pointer = "/view" + each.pointer;
  return error;
}

Error too_many_frames(const std::string& most, const std::string& asked) {
  return make_error_at(ErrorKind::too_large, "/frames",
                       "an animation has at most " + most + ", not " + asked +
                           "; draw longer ones with `windsplat animate`");
}

// The work in all, before anything is drawn. Errors: too_large at /frames.
Result<void> check_length(const movie::Motion& motion, const protocol::View& view,
                          double picture_ms) {
  const double frames = motion.frames();
  const auto whole = [](double value) { return std::to_string(static_cast<std::int64_t>(value)); };
  if (frames > limits::animation_frames_max) {
    return too_many_frames(std::to_string(limits::animation_frames_max) + " pictures",
                           whole(frames));
  }
  const double pixels = frames * view.image.width * view.image.height;
  if (pixels > static_cast<double>(limits::animation_pixels_max)) {
    return too_many_frames(std::to_string(limits::animation_pixels_max) + " pixels in all",
                           whole(pixels));
  }
  const double seconds = frames * picture_ms / 1000;
  if (seconds <= Animations::render_s_max) return {};
  return too_many_frames(whole(Animations::render_s_max) + " s of estimated rendering",
                         whole(seconds));
}

// The request, checked as far as possible without loading data. Errors: also those of the limits on
// the cost of a picture.
Result<tasks::AnimationWork> read_work(tasks::Backend& backend, access::Admission& admission,
                                       const std::string& body) {
  auto asked = protocol::parse_animation_request(body);
  if (!asked) return asked.error();
  const protocol::View& view = asked->view;
  if (view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/view/dataset", "must name a dataset");
  }
  if (view.method.name == protocol::MethodName::reference) {
    return make_error_at(ErrorKind::invalid, "/view/method/name", "must be kernel or slab");
  }
  if (auto fixed = movie::check_size_is_fixed(view); !fixed) return in_view(fixed.error());
  const auto checked = backend.check(view);
  if (!checked) return in_view(checked.error());
  auto dataset = tasks::find_shown(backend.catalogue, view);
  if (!dataset) return in_view(dataset.error());
  auto motion = movie::Motion::of(std::move(asked->motion), view, (*dataset)->info(),
                                  checked->steps, limits::animation_frames_max);
  if (!motion) return motion.error();
  const double picture_ms =
      backend.request_times.estimate_ms(view.dataset, view.method.name, checked->cost.kernels);
  if (auto fits = admission.check_estimate(checked->cost, picture_ms); !fits) {
    return in_view(fits.error());
  }
  if (auto fits = check_length(*motion, view, picture_ms); !fits) return fits.error();
  if (auto fits = movie::check_video_size(asked->format, view.image.width, view.image.height);
      !fits) {
    return in_view(make_error_at(fits.error().kind, "/image", fits.error().message));
  }
  if (auto found = movie::check_encoder(asked->format); !found) {
    return make_error_at(found.error().kind, "/format", found.error().message);
  }
  tasks::AnimationWork work{asked->view, asked->format, std::move(*motion), std::move(*dataset),
                            body};
  work.picture_ms = picture_ms;
  return work;
}

http::Response begin(tasks::Backend& backend, access::Admission& admission,
                     const std::string& base_path, const std::string& body,
                     const std::string& address) {
  auto read = read_work(backend, admission, body);
  if (!read) return http::problem_response(read.error());
  if (auto refusal = admission.picture(address)) return *refusal;
  tasks::Jobs::Terms terms;
  terms.slow = true;
  auto ticket =
      backend.references.admit(address, terms.cancel, tasks::References::Drawn::animation);
  if (!ticket) return http::problem_response(ticket.error());
  read->payer = address;
  read->base_path = base_path;
  const auto work = [&backend, asked = std::make_shared<tasks::AnimationWork>(std::move(*read)),
                     ticket = std::move(*ticket)](const tasks::Jobs::Handle& handle) {
    return tasks::draw_animation(backend, *asked, handle);
  };
  return job_response(backend.metrics, base_path, backend.jobs.submit("animation", work, terms));
}

// Of "<id>.<format>". Errors: not_found.
Result<tasks::Animations::Kept> named(tasks::Animations& animations, const std::string& name) {
  const auto container = movie::container_of(name);
  auto kept = animations.find(name.substr(0, name.rfind('.')));
  if (!container || !kept || movie::name_of(*container) != kept->description.format) {
    return make_error(ErrorKind::not_found, "unknown or expired animation: post it again");
  }
  return std::move(*kept);
}

}  // namespace

void post_animation(tasks::Backend& backend, access::Admission& admission,
                    tasks::TaskExecutor& look_ups, const std::string& base_path,
                    const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  // Asks for ffmpeg, and looks at every place of a path.
  run_later(look_ups, request, std::move(reply), "an animation", nullptr,
            [&backend, &admission, &base_path, body = request.body, address = request.address] {
              return begin(backend, admission, base_path, body, address);
            });
}

// The content of an id never changes.
http::Response get_animation(tasks::Animations& animations, const std::string& name,
                             const http::Request& request) {
  const auto kept = named(animations, name);
  if (!kept) return http::problem_response(kept.error());
  http::Response response;
  const std::string etag = '"' + kept->description.id + '"';
  response.headers = {{"Cache-Control", "private, max-age=3600, immutable"}, {"ETag", etag}};
  if (http::matches_etag(request.header("If-None-Match"), etag)) {
    response.status = 304;
    return response;
  }
  response.content_type = movie::media_type_of(*movie::container_of(name));
  response.headers.emplace_back("Content-Disposition",
                                "attachment; filename=\"" + kept->file_name + '"');
  response.body = {kept->file, kept->file->bytes()};
  return response;
}

http::Response delete_animation(tasks::Animations& animations, const std::string& name) {
  const auto kept = named(animations, name);
  if (!kept) return http::problem_response(kept.error());
  animations.remove(kept->description.id);
  return {204, "", {{"Cache-Control", "no-store"}}, {}};
}

}  // namespace windsplat::api
