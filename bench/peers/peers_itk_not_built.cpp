// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/peers/peers.h"

namespace tetwarp::bench {

std::optional<std::string> itk_version() { return {}; }
Peer make_itk_warp(const PeerInput&, const PullField&) { return {}; }
Peer make_itk_invert_and_warp(const PeerInput&, const VertexField&) { return {}; }
InversePeer make_itk_inverter(ItkInverter, const VertexField&, int) { return {}; }

}  // namespace tetwarp::bench
