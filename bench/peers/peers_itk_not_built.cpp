// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/peers/peers.h"

namespace tetwarp::bench {

std::optional<std::string> itk_version() { return {}; }
std::unique_ptr<Peer> make_itk_warp(const PeerInput&, const PullField&) { return nullptr; }
std::unique_ptr<Peer> make_itk_invert_and_warp(const PeerInput&, const VertexField&) { return nullptr; }
std::unique_ptr<InversePeer> make_itk_inverter(ItkInverter, const VertexField&, int) { return nullptr; }

}  // namespace tetwarp::bench
