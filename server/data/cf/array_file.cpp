// Common implementation of ArrayFile.
#include "server/data/cf/array_file.hpp"

#include <algorithm>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/bytes/scalar.hpp"

namespace windsplat::data::cf {

namespace {

std::string unwritten_text(const Unwritten& missing) {
  if (missing.is_all && missing.chunks == missing.looked_at) return "all of it";
  return std::to_string(missing.chunks) + (missing.is_all ? " of " : " of the first ") +
         std::to_string(missing.looked_at) + " chunks";
}

}  // namespace

int variable_named(const FileContents& contents, std::string_view name) {
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    if (contents.variables[v].name == name) return static_cast<int>(v);
  }
  return -1;
}

int dimension_named(const FileContents& contents, std::string_view name) {
  for (std::size_t d = 0; d < contents.dimensions.size(); ++d) {
    if (contents.dimensions[d].name == name) return static_cast<int>(d);
  }
  return -1;
}

Result<std::vector<double>> ArrayFile::read_all(int variable) const {
  const auto& dims = contents().variables.at(static_cast<std::size_t>(variable)).dims;
  const std::vector<std::size_t> start(dims.size(), 0);
  std::vector<std::size_t> count;
  std::size_t values = 1;
  for (const int dim : dims) {
    count.push_back(contents().dimensions.at(static_cast<std::size_t>(dim)).length);
    values *= count.back();
  }
  const double bytes = std::max(decoded_bytes(*this, variable, start, count),
                                static_cast<double>(values) * sizeof(double));
  if (auto fine = charge(variable, bytes); !fine) return fine.error();
  std::vector<double> out(values);
  if (values > 0) {
    if (auto done = read(variable, start, count, out.data()); !done) {
      return done.error();
    }
    forget_chunks(variable);  // read only once
  }
  return out;
}

Result<void> ArrayFile::charge(int variable, double bytes) const {
  if (!stored_bytes_ || charged_.count(variable) > 0) return {};
  const std::uint64_t most = voluntary_bytes_max(*stored_bytes_);
  if (charged_bytes_ + bytes <= static_cast<double>(most)) {
    charged_bytes_ += bytes;
    charged_.insert(variable);
    return {};
  }
  return make_error(
      ErrorKind::bad_data,
      "to open it, more than " + std::to_string(most) +
          " bytes must be decoded, the limit for a file of " + std::to_string(*stored_bytes_) +
          " bytes: " + in_quotes(contents().variables.at(at(variable)).name) + " is too large");
}

std::string unwritten_note(const ArrayFile& file, const std::vector<int>& variables) {
  constexpr std::size_t listed_max = 20;
  constexpr std::size_t chunks_of_one = 4096;
  std::size_t left = 4 * chunks_of_one;
  std::string text;
  std::size_t count = 0;
  for (const int v : variables) {
    const Unwritten missing = file.unwritten(v, std::min(left, chunks_of_one));
    left -= std::min(left, missing.looked_at);
    if (missing.chunks == 0 || ++count > listed_max) continue;
    text += text.empty() ? "" : ", ";
    text +=
        in_quotes(file.contents().variables.at(at(v)).name) + " (" + unwritten_text(missing) + ')';
  }
  if (count == 0) return {};
  if (count > listed_max) text += " and " + std::to_string(count - listed_max) + " more";
  return "chunks that were never written are masked: " + text;
}

double decoded_bytes(const ArrayFile& file, int variable, const std::vector<std::size_t>& start,
                     const std::vector<std::size_t>& count) {
  const std::vector<std::size_t> chunk = file.chunk(variable);
  double chunks = 1;
  for (std::size_t d = 0; d < count.size(); ++d) {
    if (count[d] == 0) return 0;
    const std::size_t along = (start[d] + count[d] - 1) / chunk[d] - start[d] / chunk[d] + 1;
    chunks *= static_cast<double>(along);
  }
  return chunks * std::max(chunk_bytes(file, variable),
                           static_cast<double>(file.chunk_cost_bytes(variable)));
}

double chunk_bytes(const ArrayFile& file, int variable) {
  const auto type = bytes::scalar_named(file.contents().variables.at(at(variable)).type);
  auto bytes = static_cast<double>(type ? bytes::size_of(*type) : sizeof(double));
  for (const std::size_t length : file.chunk(variable)) bytes *= static_cast<double>(length);
  return bytes;
}

}  // namespace windsplat::data::cf
