#include "hardware/links/autd3_udp_place.h"

#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "hardware/links/autd3_udp_protocol.h"
#include "sim/core/errors.h"

namespace touchfield::autd3_udp {

namespace {

// Where all units of an interface listen.
sockaddr_in6 all_units(unsigned interface) {
  sockaddr_in6 group{};
  group.sin6_family = AF_INET6;
  group.sin6_port = htons(kPort);
  group.sin6_scope_id = interface;
  group.sin6_addr.s6_addr[0] = 0xff;
  group.sin6_addr.s6_addr[1] = 0x02;
  group.sin6_addr.s6_addr[15] = 0x01;
  return group;
}

sockaddr_in6 resolved(const std::string& host, int port) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET6;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int failed = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found); failed != 0) {
    fail(fmt::format("{} has no IPv6 address, which it needs, e.g. autd3-udp:[::1]:{}: {}", host, port,
                     ::gai_strerror(failed)));
  }
  sockaddr_in6 address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  ::freeaddrinfo(found);
  return address;
}

}  // namespace

std::string Place::text() const {
  return port > 0       ? fmt::format("[{}] port {}", host, port)
         : host.empty() ? "the network interface where they answer"
                        : fmt::format("the network interface {}", host);
}

std::vector<sockaddr_in6> Place::groups() const {
  if (port > 0) {
    return {resolved(host, port)};
  }
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) {
    fail(fmt::format("the network interfaces cannot be listed: {}", std::strerror(errno)));
  }
  std::vector<sockaddr_in6> groups;
  std::set<std::string> names;
  for (const ifaddrs* at = all; at != nullptr; at = at->ifa_next) {
    names.insert(at->ifa_name);
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET6 || (at->ifa_flags & IFF_LOOPBACK) != 0) {
      continue;
    }
    const auto* address = reinterpret_cast<const sockaddr_in6*>(at->ifa_addr);
    if (IN6_IS_ADDR_LINKLOCAL(&address->sin6_addr) && (host.empty() || host == at->ifa_name)) {
      groups.push_back(all_units(address->sin6_scope_id));
    }
  }
  ::freeifaddrs(all);
  if (groups.empty() && !host.empty() && !names.contains(host)) {
    fail(fmt::format("there is no network interface {}; there are {}", host, fmt::join(names, ", ")));
  }
  if (groups.empty()) {
    fail(fmt::format("no link-local IPv6 address on {}; connect the units, switch them on, and switch IPv6 on",
                     host.empty() ? fmt::format("{}", fmt::join(names, ", ")) : host));
  }
  return groups;
}

std::string interfaces_of(const std::vector<sockaddr_in6>& groups) {
  std::vector<std::string> names;
  for (const sockaddr_in6& group : groups) {
    std::array<char, IF_NAMESIZE> name{};
    const bool known = ::if_indextoname(group.sin6_scope_id, name.data()) != nullptr;
    names.push_back(known ? name.data() : std::to_string(group.sin6_scope_id));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string lock_key(const sockaddr_in6& group) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET6, &group.sin6_addr, text.data(), text.size());
  return group.sin6_scope_id != 0 ? fmt::format("autd3-udp interface {}", group.sin6_scope_id)
                                  : fmt::format("autd3-udp [{}]:{}", text.data(), ntohs(group.sin6_port));
}

bool same(const sockaddr_in6& a, const sockaddr_in6& b) {
  return a.sin6_port == b.sin6_port && std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
}

void fail(const std::string& what) { throw DeviceError("autd3-udp: " + what); }

}  // namespace touchfield::autd3_udp
