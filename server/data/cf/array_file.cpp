// What every ArrayFile does alike.
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

int variable_named(const FileContents& contents, std::string_view name) {
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    if (contents.variables[v].name == name) return static_cast<int>(v);
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
  std::vector<double> out(values);
  if (values > 0) {
    if (auto done = read(variable, start, count, out.data()); !done) {
      return done.error();
    }
  }
  return out;
}

}  // namespace windsplat::data::cf
