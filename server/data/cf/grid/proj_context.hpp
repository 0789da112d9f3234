// PROJ without files: what would need its database or configuration is not found; and with its
// database, for codes of EPSG alone.
#pragma once

#include <proj.h>

#include <cstddef>
#include <string>

namespace windsplat::data::cf {

// A file system without files.
inline constexpr PROJ_FILE_API no_files{
    1,
    [](PJ_CONTEXT*, const char*, PROJ_OPEN_ACCESS, void*) -> PROJ_FILE_HANDLE* { return nullptr; },
    [](PJ_CONTEXT*, PROJ_FILE_HANDLE*, void*, std::size_t, void*) -> std::size_t { return 0; },
    [](PJ_CONTEXT*, PROJ_FILE_HANDLE*, const void*, std::size_t, void*) -> std::size_t {
      return 0;
    },
    [](PJ_CONTEXT*, PROJ_FILE_HANDLE*, long long, int, void*) { return 0; },
    [](PJ_CONTEXT*, PROJ_FILE_HANDLE*, void*) -> unsigned long long { return 0; },
    [](PJ_CONTEXT*, PROJ_FILE_HANDLE*, void*) {},
    [](PJ_CONTEXT*, const char*, void*) { return 0; },
    [](PJ_CONTEXT*, const char*, void*) { return 0; },
    [](PJ_CONTEXT*, const char*, void*) { return 0; },
    [](PJ_CONTEXT*, const char*, const char*, void*) { return 0; }};

// For proj_context_destroy(); null if there is no memory.
inline PJ_CONTEXT* context_without_files() {
  PJ_CONTEXT* const out = proj_context_create();
  if (out == nullptr) return out;
  proj_log_func(out, nullptr, [](void*, int, const char*) {});
  proj_context_set_fileapi(out, &no_files, nullptr);
  proj_context_set_enable_network(out, 0);
  return out;
}

// PROJ as installed, without network. Only to read systems of the database: files of the user may
// change how it computes. folder: of the database; empty: PROJ searches for it.
inline PJ_CONTEXT* context_with_database(const std::string& folder) {
  PJ_CONTEXT* const out = proj_context_create();
  if (out == nullptr) return out;
  proj_log_func(out, nullptr, [](void*, int, const char*) {});
  proj_context_set_enable_network(out, 0);
  if (folder.empty()) return out;
  const std::string file = folder + "/proj.db";
  proj_context_set_database_path(out, file.c_str(), nullptr, nullptr);
  return out;
}

}  // namespace windsplat::data::cf
