// Token, certificate and configuration of the daemon, and their reload on SIGHUP.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <chrono>
#include <functional>
#include <thread>

#include "tests/integration/certificate.hpp"
#include "tests/integration/cli_program.hpp"
#include "tests/integration/client.hpp"

namespace cli_test {
namespace {

using server_test::Place;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const std::string first_token = "the-first-token-0123456789";
const std::string second_token = "the-second-token-0123456789";

class CliAccess : public testing::Test {
 protected:
  void SetUp() override { dataset = synth(folder, "tornado", "8x8x8"); }

  // A secret readable by its owner only.
  std::string secret(const std::string& name, const std::string& text) const {
    const std::string path = folder.file(name);
    write_file(path, text);
    chmod(path.c_str(), 0600);
    return path;
  }
  void give_certificate(const std::string& name, int days = 2) const {
    const server_test::Certificate made = server_test::make_certificate(name, days);
    write_file(folder.file("cert.pem"), made.chain);
    secret("key.pem", made.key);
  }
  [[nodiscard]] Words tls_words() const {
    return {"--tls-cert", folder.file("cert.pem"), "--tls-key", folder.file("key.pem")};
  }
  Words serve(const Words& more) const {
    Words words{"serve", "--listen", "127.0.0.1:0", "--threads", "2", dataset};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Outcome refused(const Words& more, const Words& environment = {}) const {
    Outcome outcome = run(serve(more), environment);
    EXPECT_EQ(outcome.out, "");
    return outcome;
  }

  Folder folder;
  std::string dataset;
};

int status_with(std::uint16_t port, const std::string& token, bool tls = false) {
  return server_test::get(Place(port, tls), "/v1", {{"Authorization", "Bearer " + token}}).status;
}

// The effect of a signal is delayed.
bool eventually(const std::function<bool()>& is_so) {
  for (int turns = 0; turns < 2000; ++turns) {
    if (is_so()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

bool says(const Process& daemon, const std::string& text) {
  return eventually([&] { return daemon.messages().find(text) != std::string::npos; });
}

void stop(Process& daemon) {
  daemon.send(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.messages();
}

TEST_F(CliAccess, UsersAreNamedByTrustedProxiesOnly) {
  const Outcome anybody = refused({"--identity-header", "X-Forwarded-User"});
  EXPECT_EQ(anybody.code, 2);
  EXPECT_THAT(anybody.err, HasSubstr("--identity-header needs --trusted-proxy"));
  const Outcome wrong =
      refused({"--trusted-proxy", "127.0.0.1", "--identity-header", "X Forwarded"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--identity-header: must be the name of a header"));
}

TEST_F(CliAccess, TokenFileIsRequiredAndItsTokenNeverPrinted) {
  const std::string file = secret("token", first_token + "\n");
  Process daemon(serve({"--token-file", file}));
  const auto port = port_of(daemon);
  EXPECT_EQ(status_with(port, first_token), 200);
  EXPECT_EQ(status_with(port, second_token), 401);
  EXPECT_EQ(server_test::get(port, "/livez").status, 200);
  EXPECT_EQ(run({"healthcheck", "http://127.0.0.1:" + std::to_string(port)}).code, 0);
  stop(daemon);
  EXPECT_THAT(daemon.messages(), Not(HasSubstr(first_token)));
  EXPECT_THAT(daemon.messages(), Not(HasSubstr("is readable by other users")));
}

TEST_F(CliAccess, InvalidTokenFilePreventsStartup) {
  for (const auto& [text, reason] :
       std::vector<std::pair<std::string, std::string>>{{"", "empty"},
                                                        {"short", "16 to 512"},
                                                        {std::string(600, 'x'), "16 to 512"},
                                                        {std::string(5000, 'x'), "1024 bytes"},
                                                        {"two words of a token", "character"},
                                                        {first_token + "\nmore\n", "only line"}}) {
    const std::string file = secret("token", text);
    const Outcome outcome = refused({"--token-file", file});
    EXPECT_EQ(outcome.code, 2) << text;
    EXPECT_THAT(outcome.err, HasSubstr(file));
    EXPECT_THAT(outcome.err, HasSubstr(reason));
    if (text.size() < 10) continue;
    EXPECT_THAT(outcome.err, Not(HasSubstr(text.substr(0, 10))));
  }
  EXPECT_EQ(refused({"--token-file", folder.file("absent")}).code, 1);
  EXPECT_EQ(refused({}, {"WINDSPLAT_TOKEN_FILE=" + folder.file("absent")}).code, 1);
}

TEST_F(CliAccess, WarnsOfASecretReadableByOthers) {
  const std::string file = secret("token", first_token);
  chmod(file.c_str(), 0644);
  Process daemon(serve({"--token-file", file}));
  port_of(daemon);
  EXPECT_TRUE(says(daemon, "is readable by other users"));
}

TEST_F(CliAccess, NonLoopbackAddressRequiresATokenOrTheFlag) {
  const Words remote{"serve", "--listen", "0.0.0.0:0", "--allow-root", dataset};
  const auto with = [&](const Words& more) {
    Words words = remote;
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const Outcome bare = run(remote);
  EXPECT_EQ(bare.code, 2);
  EXPECT_THAT(bare.err, HasSubstr("--token-file"));
  EXPECT_THAT(bare.err, HasSubstr("--allow-remote"));
  give_certificate("localhost");
  EXPECT_EQ(run(with(tls_words())).code, 2) << "TLS alone does not authenticate clients";
  const Words token{"--token-file", secret("token", first_token)};
  {
    Process daemon(with(token));
    const auto port = port_of(daemon);
    EXPECT_EQ(status_with(port, first_token), 200);
    EXPECT_TRUE(says(daemon, "sent unencrypted"));
  }
  Words both = tls_words();
  both.insert(both.end(), token.begin(), token.end());
  Process daemon(with(both));
  EXPECT_EQ(status_with(port_of(daemon), first_token, true), 200);
  stop(daemon);
  EXPECT_THAT(daemon.messages(), Not(HasSubstr("sent unencrypted")));
}

TEST_F(CliAccess, HealthcheckOverTlsUsesTheTrustedCertificates) {
  give_certificate("mine");
  Process daemon(serve(tls_words()));
  const std::string line = daemon.read_until('\n');
  EXPECT_THAT(line, StartsWith("https://127.0.0.1:"));
  const std::string url = line.substr(0, line.size() - 1);
  const std::string by_name =
      "https://localhost" + url.substr(std::string("https://127.0.0.1").size());
  const Outcome untrusted = run({"healthcheck", url});
  EXPECT_EQ(untrusted.code, 1) << "untrusted certificate";
  EXPECT_THAT(untrusted.err, HasSubstr("use --ca to name certificates to trust"));
  EXPECT_EQ(run({"healthcheck", url, "--ca", folder.file("cert.pem")}).code, 0);
  EXPECT_EQ(run({"healthcheck", by_name}, {"WINDSPLAT_CA=" + folder.file("cert.pem")}).code, 0);
  write_file(folder.file("other.pem"), server_test::make_certificate("mine").chain);
  EXPECT_EQ(run({"healthcheck", url, "--ca", folder.file("other.pem")}).code, 1);
  write_file(folder.file("none.pem"), "no certificate");
  EXPECT_EQ(run({"healthcheck", url, "--ca", folder.file("none.pem")}).code, 2);
  EXPECT_EQ(run({"healthcheck", url, "--ca", folder.file("absent.pem")}).code, 1);
  // The same address by a name that is not in the certificate.
  const std::string other_name =
      "https://127.1" + url.substr(std::string("https://127.0.0.1").size());
  const Outcome elsewhere = run({"healthcheck", other_name, "--ca", folder.file("cert.pem")});
  EXPECT_EQ(elsewhere.code, 1);
  EXPECT_THAT(elsewhere.err, HasSubstr("hostname mismatch"));
}

TEST_F(CliAccess, InvalidCertificatePreventsStartup) {
  give_certificate("mine");
  const std::string cert = folder.file("cert.pem");
  EXPECT_EQ(refused({"--tls-cert", cert}).code, 2);
  EXPECT_EQ(refused({"--tls-key", folder.file("key.pem")}).code, 2);
  EXPECT_EQ(refused({"--tls-cert", cert, "--tls-key", folder.file("absent")}).code, 1);
  const std::string other = secret("other.pem", server_test::make_certificate("other").key);
  const Outcome outcome = refused({"--tls-cert", cert, "--tls-key", other});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("other.pem"));
  give_certificate("old", -1);
  Process daemon(serve(tls_words()));
  port_of(daemon);
  EXPECT_TRUE(says(daemon, "has expired")) << "clients may still trust it";
}

// --- the configuration ---------------------------------------------------------------------------

TEST_F(CliAccess, CommandLineOverridesEnvironmentOverridesConfiguration) {
  const std::string config = folder.file("windsplat.json");
  write_file(config, R"({"datasets": [")" + dataset + R"("], "listen": "127.0.0.1:0", "threads": 2,
      "base-path": "/from-config/", "max-sessions": 7, "allow-remote": false})");
  const auto url = [&](const Words& more, const Words& environment) {
    Words words{"serve", "--config", config};
    words.insert(words.end(), more.begin(), more.end());
    Process daemon(words, environment);
    return daemon.read_until('\n');
  };
  const std::string from_environment = "WINDSPLAT_BASE_PATH=/from-environment/";
  EXPECT_THAT(url({}, {}), HasSubstr("/from-config/"));
  EXPECT_THAT(url({}, {from_environment}), HasSubstr("/from-environment/"));
  EXPECT_THAT(url({"--base-path", "/from-line/"}, {from_environment}), HasSubstr("/from-line/"));
  write_file(folder.file("remote.json"),
             R"({"listen": "0.0.0.0:0", "allow-remote": true, "allow-root": true,
      "allow-origin": ["https://a.example"]})");
  Process remote({"serve", "--config", folder.file("remote.json"), "--allow-origin",
                  "https://b.example", dataset});
  const auto from = [port = port_of(remote)](const char* origin) {
    return server_test::StreamClient(port, {{"Origin", origin}}).handshake().status;
  };
  EXPECT_EQ(from("https://b.example"), 101);
  EXPECT_EQ(from("https://a.example"), 403) << "a list replaces the earlier one";
  Process by_environment({"serve"}, {"WINDSPLAT_CONFIG=" + config});
  EXPECT_THAT(by_environment.read_until('\n'), HasSubstr("/from-config/"));
}

TEST_F(CliAccess, FrameAncestorsIsAnotherNameOfAllowEmbed) {
  const auto policy = [](const std::vector<std::string>& words) {
    Process daemon(words);
    return server_test::get(port_of(daemon), "/?embed").header("content-security-policy");
  };
  const std::string directive = "frame-ancestors 'self' https://a.example";
  EXPECT_THAT(policy(serve({"--frame-ancestors", "https://a.example"})), HasSubstr(directive));
  const std::string config = folder.file("ancestors.json");
  write_file(config, R"({"frame-ancestors": "https://a.example"})");
  EXPECT_THAT(policy(serve({"--config", config})), HasSubstr(directive));
  write_file(config,
             R"({"allow-embed": "https://a.example", "frame-ancestors": "https://b.example"})");
  const Outcome both = refused({"--config", config});
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, HasSubstr("another name of allow-embed"));
}

TEST_F(CliAccess, AnOriginThatIsNoneIsRefusedByName) {
  for (const char* const origin : {"*", "null", "site.example", "https://site.example/page"}) {
    const Outcome outcome = refused({"--allow-origin", origin});
    EXPECT_EQ(outcome.code, 2) << origin;
    EXPECT_THAT(outcome.err, HasSubstr("--allow-origin '" + std::string(origin) + "'"));
  }
}

TEST_F(CliAccess, InvalidConfigurationIsReportedWithAPointer) {
  const std::string config = folder.file("windsplat.json");
  for (const auto& [text, pointer] : std::vector<std::pair<std::string, std::string>>{
           {R"({"max-session": 5})", "/max-session"},
           {R"({"config": "x"})", "/config"},
           {R"({"help": true})", "/help"},
           {R"({"max-sessions": "5"})", "/max-sessions"},
           {R"({"token-file": ""})", "/token-file"},
           {R"({"allow-host": ["a.example", ""]})", "/allow-host"},
           {R"({"max-sessions": true})", "/max-sessions"},
           {R"({"max-sessions": 0})", "/max-sessions"},
           {R"({"max-sessions": 1.5})", "/max-sessions"},
           {R"({"max-sessions": 3000000000})", "/max-sessions"},
           {R"({"threads": -1})", "/threads"},  // although the command line overrides it
           {R"({"threads": "2"})", "/threads"},
           {R"({"allow-remote": 1})", "/allow-remote"},
           {R"({"allow-remote": "true"})", "/allow-remote"},
           {R"({"listen": 8080})", "/listen"},
           {R"({"listen": ["127.0.0.1:0", 5]})", "/listen/1"},
           {R"({"allow-origin": true})", "/allow-origin"},
           {R"({"storage": "float16"})", "/storage"},
           {R"({"log-level": "loud"})", "/log-level"},
           {R"({"storage": "float32", "storage": "packed16"})", "/storage"},
           {R"({"storage": )", "not valid JSON"}}) {
    write_file(config, text);
    const Outcome outcome = refused({"--config", config});
    EXPECT_EQ(outcome.code, 2) << text << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(config));
    EXPECT_THAT(outcome.err, HasSubstr(pointer));
  }
  EXPECT_EQ(refused({"--config", folder.file("absent.json")}).code, 1);
}

// --- SIGHUP --------------------------------------------------------------------------------------

TEST_F(CliAccess, SighupReloadsTheToken) {
  const std::string file = secret("token", first_token);
  Process daemon(serve({"--token-file", file}));
  const auto port = port_of(daemon);
  ASSERT_EQ(status_with(port, first_token), 200);
  secret("token", second_token);
  EXPECT_EQ(status_with(port, second_token), 401) << "not before SIGHUP";
  daemon.send(SIGHUP);
  EXPECT_TRUE(says(daemon, "configuration reloaded"));
  EXPECT_EQ(status_with(port, second_token), 200);
  EXPECT_EQ(status_with(port, first_token), 401);
  secret("token", "short");
  daemon.send(SIGHUP);
  EXPECT_TRUE(says(daemon, "configuration is unchanged"));
  EXPECT_THAT(daemon.messages(), HasSubstr(file));
  EXPECT_EQ(status_with(port, second_token), 200);
  stop(daemon);
}

TEST_F(CliAccess, SighupReloadsTheCertificateAndAnInvalidOneChangesNothing) {
  give_certificate("first");
  Process daemon(serve(tls_words()));
  const Place place(port_of(daemon), true);
  const auto name = [&] { return server_test::Socket(place).peer_name(); };
  ASSERT_EQ(name(), "first");
  give_certificate("second");
  daemon.send(SIGHUP);
  EXPECT_TRUE(eventually([&] { return name() == "second"; }));
  write_file(folder.file("cert.pem"), server_test::make_certificate("third").chain);  // another key
  daemon.send(SIGHUP);
  EXPECT_TRUE(says(daemon, "configuration is unchanged"));
  EXPECT_EQ(name(), "second");
  EXPECT_EQ(server_test::get(place, "/livez").status, 200);
  stop(daemon);
}

TEST_F(CliAccess, SighupAppliesTheConfigurationWholeOrNotAtAll) {
  const std::string config = folder.file("windsplat.json");
  const std::string file = secret("token", first_token);
  const auto write = [&](const std::string& more) {
    write_file(config, R"({"token-file": ")" + file + "\"" + more + "}");
  };
  write("");
  Process daemon(serve({"--config", config}));
  const auto port = port_of(daemon);
  const auto from_friend = [&] {
    return server_test::StreamClient(port, {{"Authorization", "Bearer " + first_token},
                                            {"Origin", "https://friend.example"}})
        .handshake()
        .status;
  };
  EXPECT_EQ(from_friend(), 403);
  write(R"(, "allow-origin": ["https://friend.example"], "max-sessions": 9)");
  daemon.send(SIGHUP);
  EXPECT_TRUE(eventually([&] { return from_friend() == 101; }));
  EXPECT_TRUE(says(daemon, "requires a restart"));
  EXPECT_THAT(daemon.messages(), HasSubstr("option=max-sessions"));
  // One value is invalid, so none is applied.
  secret("token", second_token);
  write(R"(, "max-sessions": "many")");
  daemon.send(SIGHUP);
  EXPECT_TRUE(says(daemon, "configuration is unchanged"));
  EXPECT_THAT(daemon.messages(), HasSubstr("/max-sessions"));
  EXPECT_EQ(from_friend(), 101);
  EXPECT_EQ(status_with(port, second_token), 401);
  stop(daemon);
}

TEST_F(CliAccess, RootOnANonLoopbackAddressRequiresItsFlag) {
  if (::geteuid() != 0) GTEST_SKIP() << "not root";
  Words words{"serve", "--listen", "0.0.0.0:0", "--allow-remote", dataset};
  const Outcome refused = run(words);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--allow-root"));
  Process open(words, {"WINDSPLAT_ALLOW_ROOT=true"});
  EXPECT_EQ(server_test::get(port_of(open), "/v1").status, 200);
  Process local({"serve", "--listen", "127.0.0.1:0", dataset});
  EXPECT_EQ(server_test::get(port_of(local), "/v1").status, 200) << "loopback needs no flag";
}

TEST_F(CliAccess, SighupCannotRemoveTheTokenOfANonLoopbackServer) {
  const std::string config = folder.file("windsplat.json");
  const std::string file = secret("token", first_token);
  write_file(config,
             R"({"listen": "0.0.0.0:0", "allow-root": true, "token-file": ")" + file + "\"}");
  Process daemon({"serve", "--config", config, dataset});
  const auto port = port_of(daemon);
  for (const char* without : {R"({"listen": "0.0.0.0:0", "allow-root": true})",
                              R"({"listen": "127.0.0.1:0", "allow-root": true})"}) {
    write_file(config, without);
    const std::string before = daemon.messages();
    daemon.send(SIGHUP);
    EXPECT_TRUE(eventually([&] {
      return daemon.messages().find("configuration is unchanged", before.size()) !=
             std::string::npos;
    }));
    EXPECT_EQ(server_test::get(port, "/v1").status, 401);
  }
}

// Opening a pipe would block until a writer opens it.
TEST_F(CliAccess, PipeAsTokenFileIsRefusedWithoutBlocking) {
  const std::string file = secret("token", first_token);
  Process daemon(serve({"--token-file", file}));
  const auto port = port_of(daemon);
  std::filesystem::remove(file);
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  daemon.send(SIGHUP);
  EXPECT_TRUE(says(daemon, "configuration is unchanged"));
  EXPECT_THAT(daemon.messages(), HasSubstr("not a regular file"));
  EXPECT_EQ(status_with(port, first_token), 200);
  EXPECT_EQ(refused({"--token-file", file}).code, 2);
  stop(daemon);
}

TEST_F(CliAccess, CoreDumpsHoldNoSecrets) {
  const auto limit = [](const Process& daemon) {
    const std::string limits = read_file("/proc/" + std::to_string(daemon.id()) + "/limits");
    const std::size_t at = limits.find("Max core file size");
    return at == std::string::npos ? "none" : limits.substr(at, limits.find('\n', at) - at);
  };
  Process daemon(serve({"--token-file", secret("token", first_token)}));
  port_of(daemon);
  EXPECT_THAT(limit(daemon), testing::ContainsRegex("size +[01] +[01] +bytes"));
  give_certificate("mine");
  Process in_tls(serve(tls_words()));
  port_of(in_tls);
  EXPECT_THAT(limit(in_tls), testing::ContainsRegex("size +[01] +[01] +bytes"));
}

// DNS rebinding: the name of a page can resolve to this machine, which the browser then treats as
// same-origin.
TEST_F(CliAccess, NonLoopbackWithoutTokenAnswersOnlyKnownHostNames) {
  const auto status_for = [](std::uint16_t port, const std::string& host) {
    return server_test::raw(port, "GET /v1 HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status;
  };
  const Words remote{"serve", "--listen", "0.0.0.0:0", "--allow-remote", "--allow-root", dataset};
  const auto with = [&](const Words& more) {
    Words words = remote;
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  Process open(with({}));
  const auto port = port_of(open);
  for (const char* host : {"localhost:8080", "127.0.0.1:1", "10.1.2.3:8080", "[2001:db8::1]"}) {
    EXPECT_EQ(status_for(port, host), 200) << host;
  }
  EXPECT_EQ(status_for(port, "evil.example"), 421);
  EXPECT_EQ(status_for(port, "10.1.2.3.evil.example"), 421);
  Process named(with({"--allow-host", "winds.example", "--allow-origin", "https://a.example"}));
  const auto second = port_of(named);
  for (const char* host : {"winds.example:8080", "a.example", "10.1.2.3"}) {
    EXPECT_EQ(status_for(second, host), 200) << host;
  }
  EXPECT_EQ(status_for(second, "evil.example"), 421);
  const std::string file = secret("token", first_token);
  Process guarded(with({"--token-file", file}));
  EXPECT_EQ(status_for(port_of(guarded), "any.example"), 401) << "the token is required instead";
  Process both(with({"--token-file", file, "--allow-host", "winds.example"}));
  const auto fourth = port_of(both);
  EXPECT_EQ(status_for(fourth, "any.example"), 421);
  EXPECT_EQ(status_for(fourth, "winds.example"), 401);
  for (const char* bad : {"winds.example:80", "https://winds.example", ""}) {
    EXPECT_EQ(run(with({"--allow-host", bad})).code, 2) << bad;
  }
}

TEST_F(CliAccess, EmbeddersAreOriginsAndNothingElse) {
  const auto policy = [](Process& daemon) {
    return server_test::get(port_of(daemon), "/?embed").header("content-security-policy");
  };
  Process daemon(serve({"--allow-embed", "https://a.example,http://localhost:8080"}));
  EXPECT_THAT(policy(daemon), HasSubstr("'self' https://a.example http://localhost:8080"));
  // One of the syntax and one that would add a header; Framing.* has the others.
  for (const char* bad : {"a.example", "https://a.example\r\nX: y"}) {
    const Outcome outcome = refused({"--allow-embed", bad});
    EXPECT_EQ(outcome.code, 2) << bad;
    EXPECT_THAT(outcome.err, HasSubstr("--allow-embed")) << bad;
  }
  const std::string file = secret("token", first_token);
  Process guarded(serve({"--token-file", file, "--allow-embed", "https://a.example"}));
  EXPECT_TRUE(says(guarded, "frames of other sites get no picture"));
}

TEST_F(CliAccess, SighupBeforeStartupIsHandled) {
  const std::string file = secret("token", first_token);
  const std::string large = folder.file("large.nc");
  ASSERT_EQ(run({"synth", "tornado", "--dims", "96x96x96", "--steps", "3", "-o", large}).code, 0);
  Process daemon(serve({"--token-file", file, large, "climate", "efield"}));
  // "opened" of the first dataset: the others are still pending.
  ASSERT_TRUE(says(daemon, "opened"));
  for (int n = 0; n < 20; ++n) daemon.send(SIGHUP);
  const auto port = port_of(daemon);
  EXPECT_EQ(status_with(port, first_token), 200);
  stop(daemon);
}

}  // namespace
}  // namespace cli_test
