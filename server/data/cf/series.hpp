// Several files of one kind -> one ArrayFile, joined along time.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

// Opens the member with this index.
using OpenMember = std::function<Result<std::unique_ptr<ArrayFile>>(std::size_t member)>;

inline constexpr const char* damaged_files_mark =
    " files cannot be read, their steps are left out: ";
// For users: that files of a series cannot be read, with the reasons, which name them. members: of
// the series.
std::string damaged_files_note(const std::vector<Error>& damaged, std::size_t members);
// "; " and the note on the damaged files of a series; empty if none is damaged.
std::string damage_of(const ArrayFile& series);

// All members are opened once to read their times; afterwards at most `open_max` are open at a
// time. Steps are sorted by time across epochs; of steps with equal times, that of the later file
// is used. A file without a time dimension is one step.
class SeriesFile final : public ArrayFile {
 public:
  static constexpr std::size_t open_max = 32;

  // `name`: name of the series; `origin`: pattern or folder of its files. Errors: bad_data, naming
  // the first member that does not match the first file, and the difference. Damaged files are left
  // out with a note unless all are.
  static Result<std::unique_ptr<SeriesFile>> open(std::string name, std::size_t members,
                                                  OpenMember open_member, std::string origin = "");

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string origin() const override { return origin_.empty() ? name_ : origin_; }
  [[nodiscard]] std::string format() const override { return first_->format(); }
  [[nodiscard]] std::string identity() const override;

  [[nodiscard]] bool has_damaged_files() const { return has_damaged_files_; }
  // The variable whose values times() are in its unit, float32 if some file stores them so; null if
  // steps are numbered.
  [[nodiscard]] const FileVariable* time_coordinate() const;
  [[nodiscard]] std::vector<double> times() const;  // ascending
  // Leaves out all steps but these, which ascend, with a note.
  void keep_steps(const std::vector<std::size_t>& kept);

  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override;
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override;
  void forget_chunks(int variable) const override;

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  struct Member {
    std::size_t index = 0;  // for open_member_
    std::string identity;
    std::vector<int> variables;     // index of each variable of the first member; empty: identical
    bool has_single_times = false;  // stored as 32-bit floats
  };
  struct Step {
    std::size_t member = 0;
    std::size_t record = 0;
    double time = 0;
  };
  // Parallel to contents_.variables.
  struct Variable {
    int in_first = -1;       // its index in the first member
    int time_axis = -1;      // index of its time dimension; -1: always read from the first member
    bool as_values = false;  // stored differently by some members: unpacked on reading
  };
  struct Opened {
    std::size_t member = 0;
    std::unique_ptr<ArrayFile> file;
  };

  SeriesFile(std::string name, OpenMember open_member)
      : name_(std::move(name)), open_member_(std::move(open_member)) {}
  Result<void> begin();
  Result<void> add(std::size_t index, std::unique_ptr<ArrayFile> opened);
  Result<void> add_times(std::size_t member, const ArrayFile& file);
  Result<void> check_space(const ArrayFile& file) const;
  Result<void> check_values(const ArrayFile& file) const;
  void compare_variables(const ArrayFile& file, Member& member);
  void sort_steps();
  void finish();
  void add_time_dimension();
  [[nodiscard]] bool is_static(std::size_t in_first) const;
  [[nodiscard]] Result<const ArrayFile*> member_file(std::size_t member) const;
  Result<void> read_block(const Variable& variable, std::size_t step,
                          const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, double* out) const;
  Result<void> read_block(const Variable& variable, std::size_t step,
                          const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, float* out) const;
  template <class T>
  Result<void> read_steps(int variable, const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, T* out) const;

  std::string name_;
  std::string origin_;
  OpenMember open_member_;
  std::unique_ptr<ArrayFile> first_;
  std::array<int, 3> space_{-1, -1, -1};  // the first member's dimensions
  std::vector<int> parts_of_mesh_;        // variables of the first member that describe its mesh
  int time_ = -1;                         // time dimension; -1: members are single steps
  int time_coordinate_ = -1;              // variable of the first member; -1: steps are numbered
  std::vector<std::string> dropped_;      // per variable: why it is omitted, or empty
  std::vector<bool> as_values_;           // per variable of the first member
  std::vector<Member> members_;
  std::vector<Step> steps_;
  bool has_damaged_files_ = false;
  int time_of_all_ = -1;  // the time dimension of contents_
  FileContents contents_;
  std::vector<Variable> variables_;
  mutable std::list<Opened> opened_;  // most recently used first
};

}  // namespace windsplat::data::cf
