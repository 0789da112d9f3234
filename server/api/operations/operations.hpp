// One function a route: what documents say of it. Listed in the table of routes.cpp.
#pragma once

#include "server/api/operations/operation.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::api::operations {

// service.cpp
Operation read_live();
Operation read_ready();
Operation read_metrics();
Operation read_service();
Operation read_view_schema();
Operation list_problem_types();
Operation read_problem_type();
Operation read_color_maps();
Operation read_presets();
Operation read_stream();
Operation read_openapi();
Operation read_openapi_page();
Operation read_asyncapi();
Operation read_asyncapi_page();

// pictures.cpp
Operation draw_view();
Operation draw_dataset(frame::Format format);
Operation draw_saved_view(frame::Format format);
Operation forecast_view();
Operation pick_feature();
Operation draw_reference();
Operation read_reference();
Operation draw_animation();
Operation read_animation();
Operation remove_animation();

// datasets.cpp
Operation list_files();
Operation list_datasets();
Operation open_dataset();
Operation describe_dataset();
Operation release_dataset();
Operation list_jobs();
Operation read_job();
Operation cancel_job();

// values.cpp
Operation probe_fields();
Operation count_values();
Operation read_series();
Operation read_values();      // values.npy
Operation describe_values();  // values.json
Operation read_range();
Operation read_range_in_view();

// saved_views.cpp
Operation save_view();
Operation read_view();
Operation replace_view();
Operation patch_view();
Operation remove_view();

// uploads.cpp
Operation read_upload();
Operation upload_file();
Operation remove_upload();

// Bodies and answers that many operations have.
RequestBody view_body(std::string_view summary);
Answer json_answer(std::string_view summary, std::string_view shape);
Answer job_answer();                       // 202
Answer not_modified();                     // 304
Answer nothing(std::string_view summary);  // 204

}  // namespace windsplat::api::operations
