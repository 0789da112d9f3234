// Quotas of addresses in simulated time: connections and their reserve, token buckets of requests,
// bytes and render time, and eviction of addresses.
#include "server/access/quota.hpp"

#include <gtest/gtest.h>

#include <set>

#include "server/access/admission.hpp"

namespace windsplat::access {
namespace {

constexpr Quota::Micros second = 1'000'000;
const std::string here = "192.0.2.1";
const std::string there = "192.0.2.2";

Limits none() {
  Limits limits;
  limits.connections = limits.connections_per_address = limits.sessions_per_address = 0;
  limits.requests_per_address = limits.failed_logins_per_address = 0;
  limits.arrivals = limits.arrivals_per_address = 0;
  limits.handshake_ms = limits.handshake_ms_per_address = 0;
  limits.messages_per_address = limits.received_per_address = 0;
  return limits;
}

TEST(Quota, OneAddressCannotUseAllConnections) {
  Limits limits = none();
  limits.connections = 3;
  limits.connections_per_address = 2;
  Quota quota(limits);
  EXPECT_EQ(quota.connect(here, false, 0).place, Quota::Slot::ordinary);
  EXPECT_EQ(quota.connect(here, false, 0).place, Quota::Slot::ordinary);
  const auto third = quota.connect(here, false, 0);
  EXPECT_EQ(third.place, Quota::Slot::reserve);
  ASSERT_TRUE(third.reason);
  EXPECT_EQ(third.reason->kind, metrics::LimitKind::address_connections);
  EXPECT_EQ(third.reason->limit, 2);
  EXPECT_EQ(quota.connect(there, false, 0).place, Quota::Slot::ordinary);
  const auto full = quota.connect("192.0.2.3", false, 0);
  EXPECT_EQ(full.place, Quota::Slot::reserve);
  EXPECT_EQ(full.reason->kind, metrics::LimitKind::connections);
  quota.disconnect(here, Quota::Slot::ordinary);
  EXPECT_EQ(quota.connect(here, false, 0).place, Quota::Slot::ordinary);
}

TEST(Quota, TellsWhatIsLeftOfEachRate) {
  Limits limits = none();
  Quota unlimited(limits);
  EXPECT_TRUE(unlimited.left(here, false, 0).empty());
  limits.requests_per_address = 2;  // 20 at once
  limits.bytes_per_address = 50;
  Quota quota(limits);
  for (int n = 0; n < 5; ++n) EXPECT_FALSE(quota.request(here, false, 0));
  quota.sent(here, 600, 0);
  const auto left = quota.left(here, false, second);
  ASSERT_EQ(left.size(), 2U);
  EXPECT_STREQ(left[0].name, "requests");
  EXPECT_EQ(left[0].quota, 20);
  EXPECT_EQ(left[0].window_s, 10);
  EXPECT_EQ(left[0].remaining, 17) << "two of five came back";
  EXPECT_EQ(left[0].full_in_s, 2) << "three at two a second";
  EXPECT_STREQ(left[1].name, "bytes");
  EXPECT_EQ(left[1].quota, 500);
  EXPECT_EQ(left[1].remaining, 0) << "the last answer may exceed it";
  EXPECT_EQ(left[1].full_in_s, 11);
  EXPECT_EQ(quota.left(here, true, second)[0].remaining, 20) << "health has its own";
  EXPECT_EQ(quota.left(there, false, second)[0].remaining, 20);
}

TEST(Quota, ReserveIsLimitedInTotalAndPerAddress) {
  Limits limits = none();
  limits.connections = 1;
  Quota quota(limits);
  quota.connect(here, false, 0);
  std::size_t taken = 0;
  while (quota.connect(here, false, 0).place == Quota::Slot::reserve) ++taken;
  EXPECT_EQ(taken, Quota::reserve_per_address);
  for (std::size_t n = taken; n < Quota::reserve_max; ++n) {
    const std::string other = "198.51.100." + std::to_string(n);
    EXPECT_EQ(quota.connect(other, false, 0).place, Quota::Slot::reserve) << n;
  }
  EXPECT_EQ(quota.connect(there, false, 0).place, Quota::Slot::none);
  EXPECT_TRUE(quota.is_kept_out_by_others(there, false, 0));
  EXPECT_FALSE(quota.is_kept_out_by_others(here, false, 0)) << "by itself";
  quota.disconnect(here, Quota::Slot::reserve);
  EXPECT_EQ(quota.connect(there, false, 0).place, Quota::Slot::reserve);
}

TEST(Quota, ProxyIsLimitedInTotalOnly) {
  Limits limits = none();
  limits.connections = 8;
  limits.connections_per_address = 1;
  Quota quota(limits);
  for (int n = 0; n < 8; ++n) {
    EXPECT_EQ(quota.connect(here, true, 0).place, Quota::Slot::ordinary);
  }
  EXPECT_EQ(quota.connect(here, true, 0).place, Quota::Slot::reserve);
}

TEST(Quota, SessionsAreCountedByAddress) {
  Limits limits = none();
  limits.sessions_per_address = 2;
  Quota quota(limits);
  EXPECT_FALSE(quota.open_session(here, 0));
  EXPECT_FALSE(quota.open_session(here, 0));
  const auto refused = quota.open_session(here, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::address_sessions);
  EXPECT_FALSE(quota.open_session(there, 0));
  quota.close_session(here);
  EXPECT_FALSE(quota.open_session(here, 0));
}

TEST(Quota, RequestsRefillAtTheirRateAndHealthHasItsOwn) {
  Limits limits = none();
  limits.requests_per_address = 2;
  Quota quota(limits);
  int at_once = 0;
  while (!quota.request(here, false, 0)) ++at_once;
  EXPECT_EQ(at_once, 20) << "the burst of ten seconds";
  const auto refused = quota.request(here, false, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::requests);
  EXPECT_EQ(refused->limit, 2);
  EXPECT_EQ(refused->retry_after_s, 1);
  EXPECT_FALSE(quota.request(here, true, 0));
  EXPECT_FALSE(quota.request(there, false, 0));
  EXPECT_TRUE(quota.request(here, false, second / 2 - 1));
  EXPECT_FALSE(quota.request(here, false, second / 2));
  EXPECT_TRUE(quota.request(here, false, second / 2));
}

TEST(Quota, OnePictureMayOverdrawAndTheNextWaitsUntilRepaid) {
  Limits limits = none();
  limits.render_s_per_address = 6;
  Quota quota(limits);
  EXPECT_FALSE(quota.picture(here, 0));
  quota.rendered(here, 6 * second, 0);
  EXPECT_FALSE(quota.picture(here, 0)) << "the burst of a minute";
  quota.rendered(here, 3 * second, 0);
  const auto refused = quota.picture(here, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::render);
  EXPECT_EQ(refused->retry_after_s, 30) << "3 s of rendering at 6 s per minute";
  EXPECT_EQ(quota.throttle_delay(here, 0), 30 * second);
  EXPECT_FALSE(quota.picture(there, 0));
  EXPECT_TRUE(quota.picture(here, 30 * second - 1));
  EXPECT_FALSE(quota.picture(here, 30 * second));
}

TEST(Quota, BytesAreChargedWhenSent) {
  Limits limits = none();
  limits.bytes_per_address = 1000;
  Quota quota(limits);
  quota.sent(here, 10'000, 0);
  EXPECT_FALSE(quota.picture(here, 0)) << "the burst of ten seconds";
  quota.sent(here, 5000, 0);
  const auto refused = quota.picture(here, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::bytes);
  EXPECT_EQ(refused->retry_after_s, 5);
  EXPECT_FALSE(quota.picture(here, 5 * second));
}

TEST(Quota, WrongTokensAreLimitedPerMinute) {
  Limits limits = none();
  limits.failed_logins_per_address = 3;
  Quota quota(limits);
  for (int n = 0; n < 3; ++n) EXPECT_FALSE(quota.failed_login(here, 0)) << n;
  const auto refused = quota.failed_login(here, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::logins);
  EXPECT_EQ(refused->retry_after_s, 20);
  EXPECT_FALSE(quota.failed_login(there, 0));
  EXPECT_FALSE(quota.failed_login(here, 20 * second));
}

TEST(Quota, TokensAreCheckedUntilTooManyWereWrong) {
  Limits limits = none();
  limits.failed_logins_per_address = 2;
  Quota quota(limits);
  for (int n = 0; n < 100; ++n) ASSERT_FALSE(quota.may_try_login(here, 0)) << "checks are free";
  quota.failed_login(here, 0);
  EXPECT_FALSE(quota.may_try_login(here, 0));
  quota.failed_login(here, 0);
  const auto refused = quota.may_try_login(here, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::logins);
  EXPECT_EQ(refused->retry_after_s, 30);
  EXPECT_FALSE(quota.may_try_login(there, 0));
  EXPECT_FALSE(quota.may_try_login(here, 30 * second));
}

TEST(Quota, NewConnectionsRefillAtTheirRateAndTlsCostsMore) {
  Limits limits = none();
  limits.arrivals_per_address = 2;
  Quota quota(limits);
  for (int n = 0; n < 4; ++n) EXPECT_FALSE(quota.arrive(here, false, true, 0)) << n;
  const auto refused = quota.arrive(here, false, false, 0);
  ASSERT_TRUE(refused) << "the burst is used up";
  EXPECT_EQ(refused->kind, metrics::LimitKind::arrivals);
  EXPECT_FALSE(quota.arrive(there, false, false, 0));
  EXPECT_FALSE(quota.arrive(here, true, false, 0)) << "a proxy's";
  EXPECT_FALSE(quota.arrive(here, false, false, second / 2));
  EXPECT_TRUE(quota.arrive(here, false, true, 2 * second));
  EXPECT_FALSE(quota.arrive(here, false, true, 3 * second));
}

TEST(Quota, TotalConnectionRateIsEnforcedOnItsLargestUsers) {
  Limits limits = none();
  limits.arrivals = 5;
  limits.arrivals_per_address = 3;
  Quota quota(limits);
  int taken = 0;
  for (int n = 0; n < 60; ++n) taken += quota.arrive(n % 2 ? here : there, false, false, 0) ? 0 : 1;
  EXPECT_EQ(taken, 50);
  EXPECT_TRUE(quota.arrive(here, false, false, 0));
  EXPECT_FALSE(quota.arrive("192.0.2.3", false, false, 0));
  EXPECT_FALSE(quota.arrive(here, false, false, second));
}

TEST(Quota, AddressOverItsHandshakeTimeIsThrottled) {
  Limits limits = none();
  limits.handshake_ms_per_address = 100;
  Quota quota(limits);
  ASSERT_EQ(quota.connect(here, false, 0).place, Quota::Slot::ordinary);
  ASSERT_EQ(quota.connect(there, false, 0).place, Quota::Slot::ordinary);
  quota.handshake_took(here, false, second, 0);
  EXPECT_FALSE(quota.arrive(here, false, true, 0)) << "the burst of ten seconds";
  quota.handshake_took(here, false, second / 10, 0);
  const auto refused = quota.arrive(here, false, true, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::handshakes);
  EXPECT_EQ(refused->limit, 100);
  EXPECT_EQ(refused->retry_after_s, 1);
  EXPECT_FALSE(quota.arrive(here, false, false, 0)) << "plain TCP has no handshake";
  EXPECT_FALSE(quota.arrive(there, false, true, 0));
  EXPECT_FALSE(quota.arrive(here, false, true, second));
  quota.handshake_took(there, true, 60 * second, second);
  EXPECT_FALSE(quota.arrive(there, true, true, second)) << "a proxy carries many clients";
}

TEST(Quota, UnauthenticatedClientsExhaustTheirOwnHandshakeTimeOnly) {
  Limits limits = none();
  limits.handshake_ms = 100;
  Quota quota(limits);
  quota.authenticated(here, 0);
  for (int n = 0; n < 11; ++n) {
    const std::string stranger = "198.51.100." + std::to_string(n);
    ASSERT_FALSE(quota.arrive(stranger, false, true, 0)) << n;
    quota.handshake_took(stranger, false, second / 10, 0);
  }
  const auto refused = quota.arrive(there, false, true, 0);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, metrics::LimitKind::handshakes);
  EXPECT_FALSE(quota.arrive(here, false, true, 0)) << "authenticated";
  EXPECT_FALSE(quota.arrive(there, true, true, 0)) << "a proxy's";
  quota.handshake_took(here, false, 2 * second, 0);
  EXPECT_TRUE(quota.arrive(here, false, true, 0)) << "authenticated addresses also have a limit";
  EXPECT_FALSE(quota.arrive(there, false, true, second));
}

TEST(Quota, RemoteClientsDoNotExhaustLocalHandshakeTime) {
  Limits limits = none();
  limits.handshake_ms = 100;
  limits.handshake_ms_per_address = 50;
  Quota quota(limits);
  quota.authenticated(here, 0);
  for (const std::string& address : {there, here}) {
    ASSERT_EQ(quota.connect(address, false, 0).place, Quota::Slot::ordinary);
    quota.handshake_took(address, false, 2 * second, 0);
    ASSERT_TRUE(quota.arrive(address, false, true, 0)) << address;
  }
  EXPECT_TRUE(quota.arrive("127.0.0.2", false, true, 0))
      << "treated like any unauthenticated address";
  for (const std::string own : {"127.0.0.1", "::/64"}) {
    ASSERT_EQ(quota.connect(own, false, 0).place, Quota::Slot::ordinary);
    EXPECT_FALSE(quota.arrive(own, false, true, 0)) << own;
    quota.handshake_took(own, false, second, 0);
    const auto refused = quota.arrive(own, false, true, 0);
    ASSERT_TRUE(refused) << "only its own limit applies";
    EXPECT_EQ(refused->limit, 50);
  }
  EXPECT_FALSE(quota.arrive("127.0.0.2", false, true, 11 * second))
      << "others are not charged for it";

  limits.handshake_ms_per_address = 0;
  Quota without(limits);
  ASSERT_EQ(without.connect("127.0.0.1", false, 0).place, Quota::Slot::ordinary);
  without.handshake_took("127.0.0.1", false, 2 * second, 0);
  EXPECT_TRUE(without.arrive("127.0.0.1", false, true, 0)) << "it is limited nevertheless";
}

TEST(Quota, MessagesAreChargedBeforeMoreIsRead) {
  Limits limits = none();
  limits.messages_per_address = 10;
  limits.received_per_address = 1000;
  Quota quota(limits);
  for (int n = 0; n < 20; ++n) EXPECT_EQ(quota.message_received(here, 1, 0), 0) << n;
  EXPECT_EQ(quota.message_received(here, 1, 0), second / 10);
  EXPECT_EQ(quota.message_received(there, 2000, 0), 0);
  EXPECT_EQ(quota.message_received(there, 500, 0), second / 2);
  EXPECT_EQ(quota.message_received(there, 0, 2 * second), 0);
}

TEST(Quota, ZeroMeansNoLimit) {
  Quota quota(none());
  for (int n = 0; n < 10'000; ++n) {
    ASSERT_EQ(quota.connect(here, false, 0).place, Quota::Slot::ordinary);
    ASSERT_FALSE(quota.open_session(here, 0));
    ASSERT_FALSE(quota.request(here, false, 0));
    ASSERT_FALSE(quota.failed_login(here, 0));
    ASSERT_FALSE(quota.may_try_login(here, 0));
    ASSERT_FALSE(quota.arrive(here, false, true, 0));
    ASSERT_EQ(quota.message_received(here, 1U << 20, 0), 0);
    quota.sent(here, 1U << 30, 0);
    quota.rendered(here, 60 * second, 0);
    quota.handshake_took(here, false, 60 * second, 0);
  }
  EXPECT_FALSE(quota.picture(here, 0));
}

TEST(Quota, IdleAddressesAreForgottenExceptThoseInDebt) {
  Limits limits = none();
  limits.render_s_per_address = 1;
  Quota quota(limits);
  quota.rendered(here, 100 * second, 0);  // 99 minutes of debt
  quota.connect(there, false, 0);
  for (int n = 0; n < 100; ++n) quota.request("198.51.100." + std::to_string(n), false, 0);
  EXPECT_EQ(quota.known(), 102U);
  const Quota::Micros later = 700 * second;
  for (int n = 0; n < 200; ++n) quota.request("203.0.113.1", false, later);
  EXPECT_EQ(quota.known(), 3U);
  EXPECT_TRUE(quota.picture(here, later));
}

TEST(Quota, NumberOfAddressesIsBounded) {
  Limits limits = none();
  limits.connections_per_address = 1;
  Quota quota(limits);
  quota.connect(here, false, 0);
  for (std::size_t n = 0; n < 3 * AddressTable::addresses_max; ++n) {
    quota.request("2001:db8:0:" + std::to_string(n) + "::/64", false, 1);
  }
  EXPECT_EQ(quota.known(), AddressTable::addresses_max);
  EXPECT_EQ(quota.connect(here, false, 2).place, Quota::Slot::reserve) << "a known address";
}

TEST(Quota, UnauthenticatedClientsDoNotEvictAuthenticatedAddresses) {
  Quota quota(none());
  quota.authenticated(here, 0);
  for (std::size_t n = 0; n < 3 * AddressTable::addresses_max; ++n) {
    quota.arrive("2001:db8:0:" + std::to_string(n) + "::/64", false, true, 1);
  }
  EXPECT_EQ(quota.known(), AddressTable::addresses_max);
  EXPECT_TRUE(quota.connect(here, false, 2).known);
  EXPECT_FALSE(quota.connect(there, false, 2).known);
  EXPECT_TRUE(quota.connect(there, true, 2).known) << "as a proxy";
  for (std::size_t n = 0; n < 2 * AddressTable::addresses_max; ++n) {
    quota.authenticated("2001:db8:1:" + std::to_string(n) + "::/64", 3);
  }
  EXPECT_EQ(quota.known(), AddressTable::addresses_max)
      << "authenticated addresses are bounded, too";
}

TEST(Admission, LogsRefusedHandshakesOncePerMinute) {
  Limits limits = none();
  limits.handshake_ms_per_address = 0.1;  // one by one
  metrics::Metrics metrics;
  Quota::Micros now = 0;
  Admission admission(limits, metrics, [&now] { return now; });
  testing::internal::CaptureStderr();
  ASSERT_TRUE(admission.arrive(here, true));
  admission.handshake_took(here, false, second);
  for (int n = 0; n < 3; ++n) EXPECT_FALSE(admission.arrive(here, true));
  now = 59 * second;
  admission.log_refused_handshakes();
  const std::string first = testing::internal::GetCapturedStderr();
  testing::internal::CaptureStderr();
  now = 61 * second;
  for (int n = 0; n < 3; ++n) admission.log_refused_handshakes();
  const std::string rest = testing::internal::GetCapturedStderr();
  EXPECT_NE(first.find("connections=1 seconds=0 address=192.0.2.1"), std::string::npos) << first;
  EXPECT_EQ(first.find("connections=2"), std::string::npos);
  EXPECT_NE(rest.find("connections=2 seconds=61 address=192.0.2.1"), std::string::npos) << rest;
  EXPECT_EQ(rest.find("connections="), rest.rfind("connections=")) << "once: " << rest;
}

TEST(Admission, ReleasesSlotsWithTheirTickets) {
  Limits limits = none();
  limits.connections = 1;
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  auto first = admission.connect(here);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->reserve);
  auto second = admission.connect(here);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->reserve);
  first.reset();
  EXPECT_FALSE(admission.connect(here)->reserve);
}

TEST(Admission, RefusesWithTheLimitAndARetryTime) {
  Limits limits = none();
  limits.requests_per_address = 0.1;
  limits.connections = 1;
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const auto visitor = admission.connect("2001:db8:1:2:3::4");
  http::Request request;
  EXPECT_FALSE(admission.request(*visitor, request, false));
  EXPECT_EQ(request.address, "2001:db8:1:2::/64");
  const auto refused = admission.request(*visitor, request, false);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 429);
  EXPECT_EQ(refused->content_type, "application/problem+json");
  const auto retry = std::find(refused->headers.begin(), refused->headers.end(),
                               std::pair<std::string, std::string>("Retry-After", "10"));
  EXPECT_NE(retry, refused->headers.end());
  const std::string text(refused->body.bytes.begin(), refused->body.bytes.end());
  EXPECT_NE(text.find("0.1 requests a second (--max-requests-per-address)"), std::string::npos)
      << text;
  // In the reserve only health requests are served, and refusals are server errors.
  const auto late = admission.connect(there);
  EXPECT_EQ(admission.request(*late, request, false)->status, 503);
  EXPECT_FALSE(admission.request(*late, request, true));
}

TEST(Admission, ChargesRefusedUnreadBodies) {
  Limits limits = none();
  limits.requests_per_address = 0.1;
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const auto visitor = admission.connect(here);
  EXPECT_TRUE(admission.count_malformed(*visitor, {}));
  EXPECT_FALSE(admission.count_malformed(*visitor, {})) << "not logged yet";
  http::Request request;
  EXPECT_TRUE(admission.request(*visitor, request, false)) << "the same limit";
}

TEST(Admission, RefusesExpensiveRequests) {
  Limits limits = none();
  limits.render_s = 2;
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const frame::Cost cost{100, 1e9, "/vector/stride"};
  EXPECT_TRUE(admission.check_estimate(cost, 2000));
  const auto refused = admission.check_estimate(cost, 2001);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_EQ(refused.error().at.front().pointer, "/vector/stride");
  EXPECT_NE(refused.error().message.find("limit is 2 s (--max-render)"), std::string::npos);
  limits.render_s = 0;
  EXPECT_TRUE(Admission(limits, metrics).check_estimate(cost, 1e12));
}

TEST(Admission, ChargesTheClientBehindATrustedProxy) {
  Limits limits = none();
  limits.requests_per_address = 0.1;
  limits.trusted_proxies = {"10.0.0.0/8"};
  metrics::Metrics metrics;
  Admission admission(limits, metrics, [] { return 0; });
  const auto proxy = admission.connect("10.1.2.3");
  const auto ask = [&](const Visitor& visitor, const std::string& hops) {
    http::Request request;
    request.headers = {{"X-Forwarded-For", hops}};
    return admission.request(visitor, request, false).has_value();
  };
  EXPECT_FALSE(ask(*proxy, here));
  EXPECT_TRUE(ask(*proxy, here));
  EXPECT_FALSE(ask(*proxy, there));
  // Other addresses may send any header.
  const auto liar = admission.connect("203.0.113.9");
  EXPECT_FALSE(ask(*liar, "198.51.100.1"));
  EXPECT_TRUE(ask(*liar, "198.51.100.2"));
}

TEST(Metrics, HaveEveryLimitOnce) {
  EXPECT_EQ(std::set(metrics::limit_names.begin(), metrics::limit_names.end()).size(),
            metrics::limit_names.size());
  EXPECT_EQ(static_cast<std::size_t>(metrics::LimitKind::handshakes) + 1,
            metrics::limit_names.size());
}

}  // namespace
}  // namespace windsplat::access
