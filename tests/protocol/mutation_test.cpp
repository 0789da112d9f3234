// Property test: for any mutation of a valid document, the codec either accepts it and yields a
// stable canonical text, or rejects it with a message. Seeds are fixed, so that failures are
// reproducible.
#include <gtest/gtest.h>

#include <random>

#include "protocol/codec.hpp"
#include "protocol/frame_header.hpp"
#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

class Mutator {
 public:
  explicit Mutator(std::uint32_t seed) : random_(seed) {}

  std::size_t below(std::size_t limit) {
    return limit == 0 ? 0 : static_cast<std::size_t>(random_()) % limit;
  }

  std::string mutate(std::string text, const std::string& other) {
    const std::size_t rounds = 1 + below(3);
    for (std::size_t i = 0; i < rounds; ++i) text = step(std::move(text), other);
    return text;
  }

 private:
  std::string step(std::string text, const std::string& other) {
    static const std::vector<std::string> tokens{"null",
                                                 "true",
                                                 "[]",
                                                 "{}",
                                                 "-",
                                                 "1e999",
                                                 "-0",
                                                 "0.5",
                                                 "3000000000",
                                                 "\"\"",
                                                 ",",
                                                 ":",
                                                 "[",
                                                 "{",
                                                 "}",
                                                 "]",
                                                 "\\u0000",
                                                 "\\ud800",
                                                 "\xff",
                                                 "\xc3",
                                                 "18446744073709551616",
                                                 "NaN",
                                                 "1e-999",
                                                 std::string(1, '\0'),
                                                 "/**/",
                                                 "\"field\":null",
                                                 "\"step\":1,",
                                                 "[[[[[[[[[[[[[[[[[[[["};
    const std::size_t at = below(text.size() + 1);
    switch (below(8)) {
      case 0:  // flip a bit
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
        return text;
      case 1:  // truncate
        return text.substr(0, at);
      case 2:  // splice
        return text.substr(0, at) + other.substr(below(other.size() + 1));
      case 3:  // insert a token
        return text.insert(at, tokens[below(tokens.size())]);
      case 4:  // remove a piece
        return text.erase(at, below(12));
      case 5:  // change a number
      case 6:
        for (std::size_t i = at; i < text.size(); ++i) {
          if (text[i] < '0' || text[i] > '9') continue;
          text[i] = static_cast<char>('0' + below(10));
          break;
        }
        return text;
      default:  // repeat a piece
        return text.insert(at, text.substr(at, below(20)));
    }
  }

  std::mt19937 random_;
};

std::vector<std::string> corpus(const std::string& folder, const std::string& kind) {
  std::vector<std::string> out;
  for (const Vector& vector : read_vectors(folder)) {
    if (vector.kind() == kind) out.push_back(vector.text());
  }
  return out;
}

void expect_words(const Error& error, const std::string& input) {
  ASSERT_FALSE(error.message.empty()) << input;
  ASSERT_NE(error.kind, ErrorKind::internal) << input;
  for (const FieldError& fault : error.at) {
    ASSERT_FALSE(fault.detail.empty()) << input;
    ASSERT_TRUE(fault.pointer.empty() || fault.pointer[0] == '/') << fault.pointer;
  }
  ASSERT_TRUE(Json::accept(encode_problem(problem_from(error)))) << input;
}

TEST(Mutation, ViewIsAcceptedOrRefusedWithAMessage) {
  const auto good = corpus("valid", "view");
  const auto bad = corpus("invalid", "view");
  Mutator mutator(20240611);
  int taken = 0;
  int refused = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::string& base = good[mutator.below(good.size())];
    const std::string text = mutator.mutate(base, bad[mutator.below(bad.size())]);
    const auto document = ViewDocument::parse(text);
    if (!document) {
      ++refused;
      ASSERT_NO_FATAL_FAILURE(expect_words(document.error(), text));
      continue;
    }
    ++taken;
    const auto again = ViewDocument::parse(document->canonical());
    ASSERT_TRUE(again.has_value()) << text << " -> " << again.error().message;
    ASSERT_EQ(again->canonical(), document->canonical()) << text;
    ASSERT_EQ(encode_view(again->view()), encode_view(document->view())) << text;
    const auto complaints =
        schema_complaints("view.schema.json", "", Json::parse(encode_view(document->view())));
    ASSERT_TRUE(complaints.empty()) << text << ": " << complaints.front();
  }
  EXPECT_GT(taken, 1000) << "mutations too coarse to test anything";
  EXPECT_GT(refused, 5000);
}

TEST(Mutation, PatchGivesAValidViewOrNone) {
  const auto good = corpus("valid", "view");
  const auto bad = corpus("invalid", "view");
  Mutator mutator(7);
  ViewDocument view;
  int applied = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::string before = view.canonical();
    const std::string patch =
        mutator.mutate(good[mutator.below(good.size())], bad[mutator.below(bad.size())]);
    const auto next = view.patched(patch);
    ASSERT_EQ(view.canonical(), before) << patch;
    if (!next) {
      ASSERT_NO_FATAL_FAILURE(expect_words(next.error(), patch));
      continue;
    }
    ++applied;
    const auto again = ViewDocument::parse(next->canonical());
    ASSERT_TRUE(again.has_value()) << patch;
    ASSERT_EQ(again->canonical(), next->canonical()) << patch;
    const auto twice = next->patched(patch);
    ASSERT_TRUE(twice.has_value()) << patch;
    ASSERT_EQ(twice->canonical(), next->canonical()) << "applying a merge patch twice equals once";
    view = *next;
  }
  EXPECT_GT(applied, 1000);
}

TEST(Mutation, ClientMessageFollowsTheSchemaOrIsRefusedWithAMessage) {
  const auto good = corpus("valid", "clientMessage");
  const auto bad = corpus("invalid", "clientMessage");
  Mutator mutator(99);
  int taken = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::string& base = good[mutator.below(good.size())];
    const std::string text = mutator.mutate(base, bad[mutator.below(bad.size())]);
    const auto message = parse_client_message(text);
    if (!message) {
      ASSERT_NO_FATAL_FAILURE(expect_words(message.error(), text));
      message_tag(text);
      continue;
    }
    ++taken;
    const auto complaints =
        schema_complaints("messages.schema.json", "#/$defs/clientMessage", Json::parse(text));
    ASSERT_TRUE(complaints.empty()) << text << ": " << complaints.front();
  }
  EXPECT_GT(taken, 1000);
}

TEST(Mutation, ParsedHeaderEncodesToItself) {
  Mutator mutator(5);
  FrameHeader header;
  header.seq = 3;
  header.width = 640;
  header.height = 480;
  const auto good = encode_frame_header(header);
  const std::string base(good.begin(), good.end());
  int parsed = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::string text = mutator.mutate(base, base);
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    const auto read = parse_frame_header(bytes);
    if (!read) {
      ASSERT_FALSE(read.error().message.empty());
      continue;
    }
    ++parsed;
    const auto again = encode_frame_header(*read);
    for (std::size_t i = 0; i < again.size(); ++i) {
      // A signalling NaN may become quiet; every other byte is unchanged.
      const bool in_float = i >= 32 && i < 40;
      ASSERT_TRUE(in_float || again[i] == bytes[i]) << "byte " << i;
    }
  }
  EXPECT_GT(parsed, 200);
}

}  // namespace
}  // namespace windsplat::protocol::testing
