// The files of one step -> one snapshot: a file, the pieces of a parallel file, the blocks of a
// multi-block file, or the parts of a step of a collection. A file may refer only to files of a
// lower kind (collection, blocks, parallel header, serial file), so that none can refer to itself.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/vtk/hdf_file.hpp"
#include "server/data/formats/vtk/snapshot.hpp"
#include "server/data/formats/vtk/unite.hpp"
#include "server/data/formats/vtk/xml_document.hpp"

namespace windsplat::data::vtk {

// Limit on the files of a step.
inline constexpr std::size_t step_files_max = 16'384;

struct Step {
  std::vector<BlockFile> parts;
  std::optional<std::size_t> index;  // within a file of several steps; none: it has one
  std::optional<double> time;
  std::string identity;
};
// The files of the steps of a dataset, in order, with the times of a collection. Errors: bad_data.
Result<std::vector<Step>> steps_of(Files& files);

class StepReader {
 public:
  // inside: the block to show, "fluid" or "fluid/inner"; empty: all.
  StepReader(Files& files, std::string inside) : files_(files), inside_(std::move(inside)) {}

  // Reads the headers of a step. Several parts are united like blocks. Errors: bad_data, not_found.
  Result<Snapshot> read(const Step& step);
  // Number of files that the last step has.
  [[nodiscard]] std::size_t file_count() const { return opened_; }

 private:
  using FilePtr = std::shared_ptr<const InputFile>;

  Result<FilePtr> open(const std::string& name, const std::string& by);
  PieceFile keep(const FilePtr& file, const std::string& name);
  Result<Snapshot> read_one(const std::string& name, std::optional<std::size_t> index);
  Result<Snapshot> read_grids(const FilePtr& file, std::optional<std::size_t> index);
  Result<Snapshot> read_xml(const FilePtr& file, const std::string& name);
  Result<Snapshot> read_parallel(const Document& document, const GridType& type,
                                 const std::string& name);
  Result<void> add_piece(const ParallelHeader& header, const ParallelHeader::Member& member,
                         const std::string& name, Snapshot& out);
  Result<Snapshot> read_blocks(const FilePtr& file, const std::string& name,
                               const std::vector<BlockFile>& all);
  Result<Block> read_block(const BlockFile& part, const std::string& by);
  [[nodiscard]] Result<std::vector<BlockFile>> chosen(const InputFile& file,
                                                      const std::vector<BlockFile>& all) const;

  Files& files_;
  std::string inside_;
  std::size_t opened_ = 0;
  std::string identities_;
  std::shared_ptr<HdfFile> hdf_;  // the last one, whose steps follow each other
};

}  // namespace windsplat::data::vtk
