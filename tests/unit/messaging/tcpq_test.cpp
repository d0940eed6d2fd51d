#include "tcpq.h"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

namespace layfigure::messaging::tcpq {
namespace {

void add_word(Bytes& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

void add_text(Bytes& bytes, const std::string& text) {
  add_word(bytes, static_cast<std::uint32_t>(text.size()));
  bytes.insert(bytes.end(), text.begin(), text.end());
}

Bytes hello() {
  Bytes bytes;
  add_word(bytes, kClientMagic);
  add_word(bytes, kVersion);
  return bytes;
}

Bytes requests() {
  Bytes bytes = hello();
  add_word(bytes, 2);
  add_text(bytes, "LAYFIGURE_.*");
  const Bytes message = frame({"LAYFIGURE_POSE", {1, 2, 3}});
  bytes.insert(bytes.end(), message.begin(), message.end());
  add_word(bytes, 3);
  add_text(bytes, "LAYFIGURE_.*");
  return bytes;
}

std::string parse(Parser& parser) {
  std::ostringstream text;
  while (const std::optional<Request> request = parser.next()) {
    if (const auto* message = std::get_if<Publish>(&*request)) {
      text << "publish " << message->channel << " " << message->data.size() << "; ";
    } else if (const auto* added = std::get_if<Subscribe>(&*request)) {
      text << "subscribe " << added->pattern << "; ";
    } else {
      text << "unsubscribe " << std::get<Unsubscribe>(*request).pattern << "; ";
    }
  }
  return text.str();
}

constexpr const char* kParsed = "subscribe LAYFIGURE_.*; publish LAYFIGURE_POSE 3; unsubscribe LAYFIGURE_.*; ";

TEST(TcpqParser, WholeStream_GivesTheRequests) {
  Parser parser;
  parser.feed(requests());
  EXPECT_EQ(parse(parser), kParsed);
  EXPECT_EQ(parser.problem(), "");
}

TEST(TcpqParser, ByteByByte_GivesTheSame) {
  Parser parser;
  std::string parsed;
  for (const std::uint8_t byte : requests()) {
    parser.feed(ByteView(&byte, 1));
    parsed += parse(parser);
  }
  EXPECT_EQ(parsed, kParsed);
}

TEST(TcpqParser, WrongMagicOrVersion_IsAProblem) {
  Parser http;
  const std::string get = "GET / HTTP/1.1\r\n";
  http.feed(Bytes(get.begin(), get.end()));
  EXPECT_EQ(parse(http), "");
  EXPECT_NE(http.problem(), "");
  Parser version;
  Bytes bytes;
  add_word(bytes, kClientMagic);
  add_word(bytes, kVersion + 1);
  version.feed(bytes);
  EXPECT_EQ(parse(version), "");
  EXPECT_NE(version.problem(), "");
}

TEST(TcpqParser, UnknownRequest_IsAProblem) {
  Parser parser;
  Bytes bytes = hello();
  add_word(bytes, 4);
  parser.feed(bytes);
  EXPECT_EQ(parse(parser), "");
  EXPECT_NE(parser.problem().find("request 4"), std::string::npos);
}

TEST(TcpqParser, AbsurdLengths_AreProblemsAtOnce) {
  for (const std::uint32_t type : {1U, 2U, 3U}) {
    Parser parser;
    Bytes bytes = hello();
    add_word(bytes, type);
    add_word(bytes, 0xffffffff);
    parser.feed(bytes);
    EXPECT_EQ(parse(parser), "");
    EXPECT_NE(parser.problem(), "") << type;
  }
  Parser parser;
  Bytes bytes = hello();
  add_word(bytes, 1);
  add_text(bytes, "CHANNEL");
  add_word(bytes, 0x7fffffff);
  parser.feed(bytes);
  EXPECT_EQ(parse(parser), "");
  EXPECT_NE(parser.problem().find("message"), std::string::npos);
}

TEST(TcpqParser, RandomBytes_NeverThrows) {
  std::mt19937 random(7);
  for (int round = 0; round < 2000; ++round) {
    Parser parser;
    parser.feed(hello());
    Bytes noise(random() % 200);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random() % 4);
    parser.feed(noise);
    ASSERT_NO_THROW(parse(parser)) << "round " << round;
  }
}

}  // namespace
}  // namespace layfigure::messaging::tcpq
