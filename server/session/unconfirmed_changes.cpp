#include "server/session/unconfirmed_changes.hpp"

#include <algorithm>
#include <utility>

#include "protocol/limits.hpp"

namespace windsplat::session {
namespace {

constexpr std::size_t changes_max = 32;
constexpr std::size_t change_bytes_max = protocol::limits::message_bytes_max;

}  // namespace

void UnconfirmedChanges::add(Change change) {
  changes_.push_back(std::move(change));
  while (changes_.size() > changes_max || (changes_.size() > 1 && bytes() > change_bytes_max)) {
    confirm_oldest();
  }
}

std::size_t UnconfirmedChanges::bytes() const {
  std::size_t sum = 0;
  for (const Change& kept : changes_) sum += kept.patch_json.size();
  return sum;
}

void UnconfirmedChanges::confirm_oldest() {
  if (auto next = confirmed_.patched(changes_.front().patch_json)) confirmed_ = std::move(*next);
  confirmed_rev_ = changes_.front().rev.value_or(confirmed_rev_);
  changes_.pop_front();
}

void UnconfirmedChanges::confirm(std::uint64_t version) {
  while (!changes_.empty() && changes_.front().version <= version) confirm_oldest();
}

void UnconfirmedChanges::confirm_all(const protocol::ViewDocument& document, std::uint32_t rev) {
  confirmed_ = document;
  confirmed_rev_ = rev;
  changes_.clear();
}

std::optional<UnconfirmedChanges::Change> UnconfirmedChanges::find_fault(std::uint64_t version,
                                                                         bool newest) const {
  const auto fault = std::find_if(changes_.begin(), changes_.end(),
                                  [&](const Change& kept) { return kept.version == version; });
  if (fault != changes_.end()) return *fault;
  if (newest && !changes_.empty()) return changes_.back();
  return std::nullopt;
}

bool UnconfirmedChanges::remove(std::uint64_t version) {
  return std::erase_if(changes_, [&](const Change& kept) { return kept.version == version; }) > 0;
}

UnconfirmedChanges::Rebuilt UnconfirmedChanges::rebuilt() const {
  Rebuilt out{confirmed_, confirmed_rev_, std::nullopt};
  for (const Change& kept : changes_) {
    if (auto patched = out.document.patched(kept.patch_json)) out.document = std::move(*patched);
    out.rev = kept.rev.value_or(out.rev);
    if (kept.rev) out.unanswered = kept.version;
  }
  return out;
}

}  // namespace windsplat::session
