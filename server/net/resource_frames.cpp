// Pictures: a query or a posted view -> a job of the renderer -> encoded bytes with their report.
#include <array>
#include <exception>
#include <new>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/base/log.hpp"
#include "server/frame/frame_info.hpp"
#include "server/net/negotiate.hpp"
#include "server/net/problem.hpp"
#include "server/net/resources.hpp"
#include "server/net/target.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"

namespace windsplat::net {
namespace {

constexpr int jpeg_quality_default = 90;
constexpr double angle_max = 36000;  // degrees
constexpr double zoom_min = 1e-3;
constexpr double zoom_max = 1e3;

struct Orbit {
  double azimuth = scene::default_azimuth;
  double elevation = scene::default_elevation;
  double zoom = 1;
};

// What is to be drawn, checked as far as that goes without loading.
struct Picture {
  protocol::View view;
  frame::Encoding encoding;
  std::string preset;  // empty: none
  std::optional<Orbit> orbit;
  std::string if_none_match;
};

std::string_view media_type(frame::Format format) {
  switch (format) {
    case frame::Format::jpeg:
      return "image/jpeg";
    case frame::Format::png:
      return "image/png";
    case frame::Format::npy:
      return "application/x-npy";
  }
  return "";
}

std::string milliseconds(std::int64_t us) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3f", static_cast<double>(us) / 1000);
  return text.data();
}

// Headers are ASCII: other characters become the escapes that JSON has for them.
std::string ascii_json(std::string_view json) {
  std::string out;
  for (std::size_t i = 0; i < json.size();) {
    const auto lead = static_cast<unsigned char>(json[i]);
    const std::size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    if (length == 1) {
      out += json[i++];
      continue;
    }
    std::uint32_t code = lead & (0x7fU >> length);
    for (std::size_t k = 1; k < length && i + k < json.size(); ++k) {
      code = code << 6 | (static_cast<unsigned char>(json[i + k]) & 0x3fU);
    }
    i += length;
    std::array<char, 16> text{};
    if (code >= 0x10000) {
      const std::uint32_t rest = code - 0x10000;
      std::snprintf(text.data(), text.size(), "\\u%04x\\u%04x", 0xd800 + (rest >> 10),
                    0xdc00 + (rest & 0x3ff));
    } else {
      std::snprintf(text.data(), text.size(), "\\u%04x", code);
    }
    out += text.data();
  }
  return out;
}

// Everything that the bytes of a picture follow from.
std::string picture_etag(const protocol::View& view, const data::Dataset& dataset,
                         const frame::Encoding& encoding) {
  return etag_of(protocol::encode_view(view) + '\n' + dataset.info().digest + '\n' +
                 WINDSPLAT_VERSION + '\n' + std::string(media_type(encoding.format)) + ' ' +
                 std::to_string(encoding.quality));
}

Result<protocol::View> resolve(const Picture& picture, data::Dataset& dataset) {
  auto view = scene::complete_view(picture.view, dataset);
  if (!view || (picture.preset.empty() && !picture.orbit)) return view;
  const auto placed = scene::place_dataset(view->geometry, dataset);
  if (!placed) return placed.error();
  const scene::Lattice& lattice = (*placed)->lattice;
  if (!picture.preset.empty()) {
    if (const auto ok = scene::apply_preset(*view, lattice, picture.preset); !ok) {
      return ok.error();
    }
  }
  if (picture.orbit) {
    const Orbit& orbit = *picture.orbit;
    scene::orbit(*view, lattice, orbit.azimuth, orbit.elevation, orbit.zoom);
  }
  return scene::complete_view(*view, dataset);
}

Result<Response> draw(Services& services, const Picture& picture, data::Dataset& dataset,
                      std::int64_t queue_us, const CancelToken& cancel) {
  const auto view = resolve(picture, dataset);
  if (!view) return view.error();
  Response response;
  // Within a budget the server may choose, so the picture is not the view's alone.
  if (view->quality.budget_ms) {
    response.headers = {{"Cache-Control", "no-store"}};
  } else {
    const std::string etag = picture_etag(*view, dataset, picture.encoding);
    response.headers = {{"Cache-Control", "no-cache"}, {"ETag", etag}};
    if (matches_etag(picture.if_none_match, etag)) {
      response.status = 304;
      return response;
    }
  }
  auto drawn =
      frame::produce(*view, dataset, picture.encoding, *services.pool, cancel, services.frames);
  if (!drawn) return drawn.error();
  response.content_type = media_type(picture.encoding.format);
  response.headers.emplace_back("Server-Timing",
                                "queue;dur=" + milliseconds(queue_us) +
                                    ", render;dur=" + milliseconds(drawn->render_us) +
                                    ", encode;dur=" + milliseconds(drawn->encode_us));
  response.headers.emplace_back(
      "Windsplat-Frame",
      ascii_json(protocol::encode_frame_info(frame::frame_info(*drawn, drawn->view))));
  response.headers.emplace_back("Vary", "Accept");
  // A picture is meant for any page's <img>; its pixels stay out of that page's reach.
  response.headers.emplace_back("Cross-Origin-Resource-Policy", "cross-origin");
  response.body = Body::of(std::move(drawn->bytes));
  return response;
}

Response draw_guarded(Services& services, const Picture& picture, data::Dataset& dataset,
                      std::int64_t queue_us, const CancelToken& cancel) {
  if (cancel.cancelled()) {
    return problem_response(make_error(ErrorKind::cancelled, "nobody waits for the answer"));
  }
  try {
    auto response = draw(services, picture, dataset, queue_us, cancel);
    return response ? std::move(*response) : problem_response(response.error());
  } catch (const std::bad_alloc&) {
    return problem_response(
        make_error(ErrorKind::out_of_memory, "there is no memory left for this picture"));
  } catch (const std::exception& fault) {
    log::error("a picture failed", {{"fault", fault.what()}});
    return problem_response(make_error(ErrorKind::internal, "the picture could not be drawn"));
  }
}

void submit(Services& services, Picture picture, std::shared_ptr<data::Dataset> dataset,
            const Request& request, Reply reply) {
  picture.if_none_match = request.header("If-None-Match");
  const auto shared_reply = std::make_shared<Reply>(std::move(reply));
  const CancelToken cancel = request.cancel;
  const auto queued = services.renderer.submit(
      {RenderService::Kind::request, request.peer, cancel,
       [&services, picture = std::move(picture), dataset = std::move(dataset), cancel,
        shared_reply](std::int64_t queue_us) {
         (*shared_reply)(draw_guarded(services, picture, *dataset, queue_us, cancel));
       }});
  if (!queued) (*shared_reply)(problem_response(queued.error()));
}

// --- GET /v1/datasets/{id}/frame.* --------------------------------------------------------------

// Numbers go into the view as they were written, so that its reader names what is out of range.
std::string view_json(const std::optional<std::string>& step,
                      const std::optional<std::string>& width,
                      const std::optional<std::string>& height) {
  std::string image;
  if (width) image += "\"width\":" + *width;
  if (height) image += (image.empty() ? "\"height\":" : ",\"height\":") + *height;
  std::string json = "{\"image\":{" + image + '}';
  if (step) json += ",\"step\":" + *step;
  return json + '}';
}

std::optional<Orbit> read_orbit(QueryReader& query) {
  const auto azimuth = query.number("azimuth", -angle_max, angle_max);
  const auto elevation = query.number("elevation", -90, 90);
  const auto zoom = query.number("zoom", zoom_min, zoom_max);
  if (!azimuth && !elevation && !zoom) return std::nullopt;
  Orbit orbit;
  orbit.azimuth = azimuth.value_or(orbit.azimuth);
  orbit.elevation = elevation.value_or(orbit.elevation);
  orbit.zoom = zoom.value_or(orbit.zoom);
  return orbit;
}

Result<Picture> read_query(const Request& request, frame::Format format) {
  QueryReader query(request.query);
  Picture picture;
  picture.encoding.format = format;
  picture.encoding.quality = jpeg_quality_default;
  const auto step = query.integer("step");
  const auto width = query.integer("width");
  const auto height = query.integer("height");
  picture.orbit = read_orbit(query);
  picture.preset = query.text("preset").value_or("");
  if (format == frame::Format::jpeg) {
    picture.encoding.quality = query.integer("quality", 1, 100).value_or(jpeg_quality_default);
  }
  if (const auto ok = query.finish(); !ok) return ok.error();
  const auto document = protocol::ViewDocument::parse(view_json(step, width, height));
  if (!document) return document.error();
  picture.view = document->view();
  return picture;
}

// --- POST /v1/frames ----------------------------------------------------------------------------

bool is_json(std::string_view content_type) {
  return equal_without_case(split_list(content_type, ';')[0], "application/json");
}

Result<Picture> read_view(const Request& request, frame::Format format) {
  const auto document = protocol::ViewDocument::parse(request.body);
  if (!document) return document.error();
  Picture picture;
  picture.view = document->view();
  picture.encoding.format = format;
  picture.encoding.quality = jpeg_quality_default;
  if (picture.view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/dataset", "must name a dataset");
  }
  return picture;
}

}  // namespace

std::optional<frame::Format> format_of_suffix(std::string_view name) {
  if (name == "frame.jpg") return frame::Format::jpeg;
  if (name == "frame.png") return frame::Format::png;
  if (name == "frame.npy") return frame::Format::npy;
  return std::nullopt;
}

void get_frame(Services& services, const std::string& id, frame::Format format,
               const Request& request, Reply reply) {
  auto dataset = services.catalogue.find(id);
  if (!dataset) {
    reply(problem_response(make_error(ErrorKind::not_found, dataset.error().message)));
    return;
  }
  auto picture = read_query(request, format);
  if (!picture) {
    reply(problem_response(picture.error()));
    return;
  }
  picture->view.dataset = id;
  if (const auto drawable = services.catalogue.check(picture->view); !drawable) {
    reply(problem_response(drawable.error()));
    return;
  }
  submit(services, std::move(*picture), std::move(*dataset), request, std::move(reply));
}

void post_frame(Services& services, const Request& request, Reply reply) {
  constexpr std::array<frame::Format, 3> formats{frame::Format::jpeg, frame::Format::png,
                                                 frame::Format::npy};
  constexpr std::array<std::string_view, 3> types{"image/jpeg", "image/png", "application/x-npy"};
  if (!is_json(request.header("Content-Type"))) {
    reply(problem_response(415, "Unsupported Media Type", "a view is application/json"));
    return;
  }
  const auto type = choose_type(request.header("Accept"), types);
  if (!type) {
    reply(problem_response(406, "Not Acceptable",
                           "pictures are image/jpeg, image/png or application/x-npy"));
    return;
  }
  auto picture = read_view(request, formats[*type]);
  if (!picture) {
    reply(problem_response(picture.error()));
    return;
  }
  const auto drawable = services.catalogue.check(picture->view);
  if (!drawable) {
    reply(problem_response(drawable.error()));
    return;
  }
  auto dataset = services.catalogue.find(picture->view.dataset);
  if (!dataset) {
    reply(problem_response(dataset.error()));
    return;
  }
  submit(services, std::move(*picture), std::move(*dataset), request, std::move(reply));
}

}  // namespace windsplat::net
