// Pictures of views and what they show.
#include "server/api/operations/operations.hpp"
#include "server/api/operations/parameters.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view pictures_group = "Pictures";

Answer picture(MediaTypes media) {
  return {200,
          "The picture; Windsplat-Frame tells method, work and error.",
          {},
          std::move(media),
          {"ETag", "Server-Timing", "Windsplat-Frame", "Vary"}};
}

Answer unchanged_picture() {
  Answer out = not_modified();
  out.headers.push_back("Vary");
  return out;
}

struct FormatWords {
  std::string_view dataset_id;
  std::string_view view_id;
  std::string_view dataset_summary;
  std::string_view view_summary;
  std::string_view media;
};

FormatWords words_of(frame::Format format) {
  switch (format) {
    case frame::Format::jpeg:
      return {"drawJpeg", "drawViewJpeg", "A dataset as JPEG", "A saved view as JPEG",
              "image/jpeg"};
    case frame::Format::png:
      return {"drawPng", "drawViewPng", "A dataset as PNG", "A saved view as PNG", "image/png"};
    case frame::Format::npy:
      return {"drawNpy", "drawViewNpy", "A dataset as an array of linear premultiplied RGBA",
              "A saved view as an array of linear premultiplied RGBA", "application/x-npy"};
    case frame::Format::pdf:
      return {"drawPdf", "drawViewPdf", "A dataset as PDF", "A saved view as PDF",
              "application/pdf"};
    case frame::Format::svg:
      return {"drawSvg", "drawViewSvg", "A dataset as SVG", "A saved view as SVG", "image/svg+xml"};
  }
  return {};
}

// The picture of a view, changed by the parameters of an address.
Operation draw_address(frame::Format format) {
  Operation out{.group = pictures_group,
                .query = {parameters::width, parameters::height, parameters::azimuth,
                          parameters::elevation, parameters::zoom, parameters::step,
                          parameters::time, parameters::nearest, parameters::drawn_fields,
                          parameters::color_map, parameters::annotate, parameters::preset},
                .answers = {picture({words_of(format).media}), unchanged_picture()},
                .problems = {404, 413, 422, 507}};
  if (format == frame::Format::jpeg) {
    out.query.push_back(parameters::quality);
  } else if (format != frame::Format::npy) {
    out.query.push_back(parameters::dpi);
  }
  return out;
}

}  // namespace

Operation draw_view() {
  return {.id = "drawView",
          .group = pictures_group,
          .summary = "A view rendered to a picture",
          .description = "Accept selects JPEG (the default), PNG, NPY, PDF or SVG.",
          .query = {parameters::dpi},
          .body = view_body("The view, which names its dataset."),
          .answers = {picture({"image/jpeg", "image/png", "application/x-npy", "application/pdf",
                               "image/svg+xml"}),
                      unchanged_picture()},
          .problems = {404, 406, 422, 507}};
}

Operation draw_dataset(frame::Format format) {
  Operation out = draw_address(format);
  out.id = words_of(format).dataset_id;
  out.summary = words_of(format).dataset_summary;
  out.description = "The default view of the dataset, changed by the parameters.";
  return out;
}

Operation draw_saved_view(frame::Format format) {
  Operation out = draw_address(format);
  out.id = words_of(format).view_id;
  out.summary = words_of(format).view_summary;
  out.description = "The saved view, changed by the parameters.";
  return out;
}

Operation forecast_view() {
  return {.id = "forecastView",
          .group = pictures_group,
          .summary = "Expected time and error of a view at each setting",
          .description = "Nothing is rendered or loaded.",
          .body = view_body("The view, which names its dataset."),
          .answers = {json_answer("The settings, fastest first.", "forecast")},
          .problems = {404, 409, 422, 507}};
}

Operation pick_feature() {
  return {.id = "pickFeature",
          .group = pictures_group,
          .summary = "What a pixel of a view shows",
          .query = {parameters::pixel_x, parameters::pixel_y},
          .body = view_body("The view, which names its dataset."),
          .answers = {json_answer("The line, part of a medium or surface.", "pick")},
          .problems = {404, 422, 507}};
}

Operation draw_reference() {
  return {.id = "drawReference",
          .group = pictures_group,
          .summary = "The rendering integral of a view, in a job",
          .description =
              "The result of the job has the address of the picture, and the error of "
              "the view's own picture.",
          .body = view_body("The view, which names its dataset."),
          .answers = {job_answer()},
          .problems = {404, 422, 507}};
}

Operation read_reference() {
  return {.id = "readReference",
          .group = pictures_group,
          .summary = "The picture of a finished reference",
          .description = "The id ends in .png.",
          .answers = {{200, "The picture.", {}, {"image/png"}, {"ETag"}}, not_modified()},
          .problems = {404}};
}

Operation draw_animation() {
  return {.id = "drawAnimation",
          .group = pictures_group,
          .summary = "A movie of a view, in a job",
          .description =
              "The result of the job has the address of the movie. It is drawn while "
              "the server is otherwise idle.",
          .body = RequestBody{"animationRequest", {json_media}, "The view and its motion."},
          .answers = {job_answer()},
          .problems = {404, 422, 507}};
}

Operation read_animation() {
  return {.id = "readAnimation",
          .group = pictures_group,
          .summary = "The file of a finished animation",
          .description = "The id ends in .mp4, .webm or .zip.",
          .answers = {{200,
                       "The movie.",
                       {},
                       {"video/mp4", "video/webm", "application/zip"},
                       {"ETag", "Content-Disposition"}},
                      not_modified()},
          .problems = {404}};
}

Operation remove_animation() {
  return {.id = "removeAnimation",
          .group = pictures_group,
          .summary = "Remove a finished animation",
          .answers = {nothing("It is removed.")},
          .problems = {404}};
}

}  // namespace windsplat::api::operations
