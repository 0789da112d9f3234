// The parts that the page of the server and <windsplat-view> are made of. Unlike those of the main
// module they may change in every minor version.
export * from "./base/resizing";
export * from "./base/time_text";
export * from "./base/values";
export * from "./base/vec3";
export * from "./view/camera_control";
export * from "./view/fit_view";
export * from "./view/patch_answers";
export * from "./view/picture_size";
export * from "./view/view_model";
export * from "./view/view_state";
export * from "./viewport/camera_keys";
export * from "./viewport/camera_turn";
export * from "./viewport/frame_state";
export * from "./viewport/input";
export * from "./viewport/video_offer";
export * from "./viewport/video_pictures";
export * from "./viewport/viewport";
export * from "./wire/browser_link";
export * from "./wire/color_maps";
export * from "./wire/connection";
export * from "./wire/frame_request";
export * from "./wire/reach";
export * from "./wire/requests";
export * from "./wire/stored_views";
export * from "./wire/view_shape";
