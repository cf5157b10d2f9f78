// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tetwarp::apps {

/// Whether something in a formula is drawn at random: a range, LOW..HIGH, or the seed of an `elastic` that states none.
bool is_random(const std::string& formula);

/// Replaces what is random in a formula: each LOW..HIGH (a suffix behind it, as in `2..8vox`, belongs to the number)
/// becomes a number of at most six significant digits, uniform between them, and an `elastic` without a seed gets one.
///
/// The number for component `c`, from 0 (of X/Y/Z; else 0), of a parameter is LOW + u (HIGH - LOW), u = floor(h / 2^11)
/// / 2^53, where h = m(g + c) and g is the result of h = m(m(m(seed) + variant) + field) and then h = m(h + byte) for
/// each byte of the parameter's name; m is `split_mix`, sums are modulo 2^64. A seed is floor(h / 2^12) of the name
/// "seed", component 0. So a number depends on no other parameter.
///
/// @param variant  number of the variant among those of the row, from 0
/// @param field    number of the field among those of the case, from 0
/// @throws InputError for a range whose ends are not numbers, or with LOW above HIGH
std::string draw(const std::string& formula, std::uint64_t seed, std::uint64_t variant, std::uint64_t field);

}  // namespace tetwarp::apps
