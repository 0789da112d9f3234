#include "server/data/fetch/noted_files.hpp"

#include <cstddef>

namespace windsplat::data::fetch {

namespace {

constexpr std::size_t noted_max = 4096;
constexpr std::chrono::minutes unfit_time{1};

// Whether it was added.
bool add_to(std::set<std::string>& files, const std::string& one) {
  if (files.size() >= noted_max) files.clear();
  return files.insert(one).second;
}

}  // namespace

bool NotedFiles::is_unfit(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto at = unfit_.find(key);
  if (at == unfit_.end()) return false;
  if (Clock::now() - at->second < unfit_time) return true;
  unfit_.erase(at);
  return false;
}

void NotedFiles::note_unfit(const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (unfit_.size() >= noted_max) unfit_.clear();
  unfit_[key] = Clock::now();
}

bool NotedFiles::was_whole(const std::string& key) {
  const std::lock_guard lock(mutex_);
  return whole_.contains(key);
}

void NotedFiles::note_whole(const std::string& key) {
  const std::lock_guard lock(mutex_);
  add_to(whole_, key);
}

void NotedFiles::forget_whole(const std::string& key) {
  const std::lock_guard lock(mutex_);
  whole_.erase(key);
}

bool NotedFiles::is_kept(const std::string& state) {
  const std::lock_guard lock(mutex_);
  return kept_.contains(state);
}

bool NotedFiles::note_kept(const std::string& state) {
  const std::lock_guard lock(mutex_);
  return add_to(kept_, state);
}

}  // namespace windsplat::data::fetch
