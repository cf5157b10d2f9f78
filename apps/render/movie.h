// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "io/png.h"

namespace tetwarp::apps {

/// Whether a file name stands for a film: it ends with .mp4 or .gif.
bool is_movie(const std::filesystem::path& output);

/// Looks for ffmpeg, which makes films, in PATH. @param output  the film, for the message
/// @throws Error where it is not found
void require_movie_encoder(const std::filesystem::path& output);

/// Makes a film of pictures of one size. They go to ffmpeg through a pipe; no file but the film has them.
/// @param target    the file that is written, under a hidden name until it is whole
/// @param name      the name that it will have, which tells its format, and which messages show
/// @param pictures  how many
/// @param rate      pictures a second
/// @param stop      ends ffmpeg at once
/// @param picture   makes the Nth picture, from 0; called in order, by this thread
/// @throws Error where ffmpeg fails; Cancelled
void write_movie(const std::filesystem::path& target, const std::filesystem::path& name, std::size_t pictures,
                 double rate, const std::function<Picture(std::size_t)>& picture, const std::stop_token& stop);

}  // namespace tetwarp::apps
