#pragma once

#include <netinet/in.h>
#include <string>
#include <vector>

namespace touchfield::autd3_udp {

/// Where units are: at an address, or somewhere on a network interface.
struct Place {
  std::string host;  // a network interface by name, or an address if there is a port; empty: any interface
  int port = 0;      // of the address, 0: host names an interface

  /// "the network interface eth0", "[::1] port 44336"
  std::string text() const;
  /// Where to ask for units: the address, or the group of all nodes on each interface with a link-local IPv6 address.
  /// throws   DeviceError, with the interfaces there are, if there is none
  std::vector<sockaddr_in6> groups() const;
};

/// "eth0, wlan0": the interfaces of groups.
std::string interfaces_of(const std::vector<sockaddr_in6>& groups);

/// The key of DeviceLock to the units of a group. They have no addresses of their own: these go by their numbers.
std::string lock_key(const sockaddr_in6& group);

bool same(const sockaddr_in6& a, const sockaddr_in6& b);

/// throws   DeviceError "autd3-udp: WHAT"
[[noreturn]] void fail(const std::string& what);

}  // namespace touchfield::autd3_udp
