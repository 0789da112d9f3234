// Message payloads: location and limits to the loader; errors and dataset info back. Decoding
// validates everything on which the rest of the program relies.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::data::loader {

inline constexpr std::size_t info_bytes_max = std::size_t{1} << 30;
inline constexpr std::size_t question_bytes_max = std::size_t{1} << 16;

// What a loader receives before it opens a file. Paths stay with the daemon.
struct Task {
  std::uint64_t memory_bytes = 0;
  std::vector<std::string> library_folders;
  Location location;  // members and pattern without folders
};

std::string encode_task(const Task& task);
Result<Task> decode_task(std::string_view bytes);

// What Kind::read asks for.
struct Wanted {
  std::uint64_t field = 0;
  std::uint64_t step = 0;
  StoredPart part;
  // In parts through a window with halves of so many layers, of the whole only; 0: at once.
  std::uint64_t window_layers = 0;
  bool keeps_memory = false;  // for the next volume
};
std::string encode_wanted(const Wanted& wanted);
// Errors: internal if it is malformed, or not of the dataset: field, step, part.
Result<Wanted> decode_wanted(std::string_view bytes, const DatasetInfo& info);

std::string encode_error(const Error& error);
// Decodes any bytes: the result is an error of a kind that readers return, with a printable
// message.
Error decode_error(std::string_view bytes);

std::string encode_info(const DatasetInfo& info);
// Errors: bad_data for malformed info, or for info that no reader returns: axes that are not finite
// and strictly monotonic, fields without components, no steps, levels that fault_of() refuses, or
// more than the limits of cf.
// Strings are made printable.
Result<DatasetInfo> decode_info(std::string_view bytes);

// Empty for a file of which all bytes are present.
std::string encode_parts(const FileParts& parts);
Result<FileParts> decode_parts(std::string_view bytes);

// At most expected_extents_max extents. Errors: internal.
inline constexpr std::size_t expected_extents_max = 2048;
std::string encode_expected(const Expected& expected);
Result<Expected> decode_expected(std::string_view bytes);

std::string encode_names(const std::vector<std::string>& names);
Result<std::vector<std::string>> decode_names(std::string_view bytes);

}  // namespace windsplat::data::loader
