#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "hardware/array_link.h"
#include "hardware/link_address.h"

namespace touchfield {

/// What a link needs to know beside its address.
struct LinkSettings {
  std::string address;     // see LinkAddress
  ArrayLayout array;       // of the run: a dry run takes its shape, autd3-udp the places of its units; may be without
                           // transducers where the device alone says what it is
  std::size_t frames = 1;  // that are to come; of a dry run
  bool replace = false;    // the files of a dry run that are there
};

/// The link that an address names, not yet open: no device is touched.
///
/// An AUTD3 link without an array is one unit at the origin.
/// throws   InputError: the address, an array that is not of AUTD3 units, a dry run without an array
std::unique_ptr<ArrayLink> make_link(const LinkSettings& settings);

}  // namespace touchfield
