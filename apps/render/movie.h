// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "io/png.h"

namespace tetwarp::apps {

/// Whether a name means a film: .mp4 or .gif.
bool is_movie(const std::filesystem::path& output);

/// @throws Error where ffmpeg, which makes films, is not found
void require_movie_encoder(const std::filesystem::path& output);

/// Makes a film of pictures of one size. They go to ffmpeg through a pipe, and are in no file but the film.
/// @param picture  makes the Nth, from 0
/// @param target   where it is written; its form is that of `name`
/// @param stop     ends ffmpeg at once
/// @throws Error where ffmpeg fails; Cancelled
void write_movie(const std::filesystem::path& target, const std::filesystem::path& name, std::size_t pictures,
                 double rate, const std::function<Picture(std::size_t)>& picture, const std::stop_token& stop);

}  // namespace tetwarp::apps
