// Reads line by line: sections are lines without a colon, entries have one, and numbers continue on
// the lines after their entry.
#include "server/vtk_loader/ensight_times.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

namespace windsplat::vtk_loader {

namespace {

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(std::move(word));
  return words;
}

class CaseReader {
 public:
  void read(const std::string& line) {
    const auto colon = line.find(':');
    if (colon == std::string::npos) return continues(words_of(line));
    std::string key;
    for (const std::string& word : words_of(line.substr(0, colon))) {
      key += key.empty() ? word : " " + word;
    }
    is_values_ = false;
    entry(key, words_of(line.substr(colon + 1)));
  }
  EnSightTimes take() {
    for (auto& [set, times] : found_.sets) {
      const auto at = std::adjacent_find(times.begin(), times.end(),
                                         [](double a, double b) { return !(a < b); });
      found_.ascends = found_.ascends && at == times.end();
    }
    return std::move(found_);
  }

 private:
  void continues(const std::vector<std::string>& words) {
    if (words.size() == 1 &&
        words.front().find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") == std::string::npos) {
      section_ = words.front();
      is_values_ = false;
    } else if (is_values_) {
      add(words);
    }
  }

  void entry(const std::string& key, const std::vector<std::string>& words) {
    if (section_ == "FILE" || key == "file set") found_.has_file_sets = true;
    if (section_ == "TIME" && key == "time set" && !words.empty()) set_ = words.front();
    if (section_ == "TIME" && key == "time values") {
      is_values_ = true;
      add(words);
    }
    // [time set [file set]] name file
    if (section_ == "VARIABLE" && words.size() >= 3) {
      const bool of_elements = key.ends_with("per element");
      found_.set_of[EnSightTimes::key_of(words[words.size() - 2], of_elements)] = words.front();
    }
  }

  void add(const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      std::istringstream in(word);
      double time = 0;
      if (in >> time) {
        found_.sets[set_].push_back(time);
      } else {
        found_.ascends = false;
      }
    }
  }

  EnSightTimes found_;
  std::string section_, set_;
  bool is_values_ = false;
};

}  // namespace

std::vector<double> EnSightTimes::most_frequent() const {
  std::map<std::string, int> variables;
  for (const auto& [variable, set] : set_of) ++variables[set];
  const auto most =
      std::max_element(variables.begin(), variables.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  const auto found = most == variables.end() ? sets.end() : sets.find(most->first);
  return found == sets.end() ? std::vector<double>() : found->second;
}

EnSightTimes times_of_case(const std::string& text) {
  CaseReader reader;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with('#')) reader.read(line);
  }
  return reader.take();
}

}  // namespace windsplat::vtk_loader
