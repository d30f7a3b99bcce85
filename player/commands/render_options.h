// SPDX-License-Identifier: Apache-2.0
// Declares the options that play, bench and stability have in common. CLI11 checks each value as it is read;
// checkRenderOptions() checks options against each other.
#pragma once

#include "runtime/records/score_options.h"
#include "player/options/play_options.h"
#include "runtime/cli/options.h"

#include <string>

namespace gsc {

void addFile(CLI::App& app, PlayOptions& options);
void addCameras(CLI::App& app, PlayOptions& options);
void addCameraReading(CLI::App& app, PlayOptions& options); // adds the options on how camera files are read
void addOwnCamera(CLI::App& app, PlayOptions& options);     // adds --position and --look-at
// Throws Error(Usage) if one of --position and --look-at is missing, or both are the same place.
void checkOwnCamera(const CLI::App& app, const CameraChoice& choice);
void addFrames(CLI::App& app, PlayOptions& options); // adds --frames A:B
// Adds the options for picture size, angle of view and eyes, and those of addLookOptions().
void addViewOptions(CLI::App& app, PlayOptions& options, const std::string& size = "the camera's");
void addLookOptions(CLI::App& app, PlayOptions& options); // adds the options for colours and for drawing two eyes
// Source of the views: a list of cameras, or a person at a window or in a headset.
enum class Views { Cameras, Window, Headset };
// Adds the options for tier, backend, memory, foveation, reuse, detail and levels.
void addRunOptions(CLI::App& app, PlayOptions& options, Views views = Views::Cameras);
// Adds --shard. `what` names the work that is split, such as "the frames"; `file` names the option whose file keeps
// the finished work of a shard, such as "--stats".
void addShard(CLI::App& app, PlayOptions& options, const char* what, const char* file);
void addScoreFrames(CLI::App& app, ScoreOptions& score); // adds --score-every and --score-first
void addTargetOption(CLI::App& app, PlayOptions& options, Views views = Views::Cameras);
void addFirstPicture(CLI::App& app, PlayOptions& options); // adds --first-picture: draws while the model loads
void settleFirstPicture(PlayOptions& options); // call after parsing: switches --first-picture off for tier exact

// Adds an option `name` that takes the name of a backend, and "auto" if `or_auto`. Names of all backends are accepted;
// a backend that this build lacks is refused when it is opened.
OptionHandle addBackend(CLI::App& app, const char* name, std::string& field, bool or_auto, const char* help);

// Throws Error(Usage) if --shard is given but `file`, the value of option `option`, is empty: a shard needs a file for
// its finished work.
void checkShardFile(const PlayOptions& options, const char* option, const std::string& file);

// Returns the name of the option that asked for detail. Precondition: one did.
const char* detailOption(const CLI::App& app);

// Throws Error(Usage) if an option is given that has an effect only with two eyes (--ipd, --stereo merged), but one
// eye is drawn. `takes_two_eyes`: two eyes may be drawn, whatever --eyes says.
void checkEyes(const CLI::App& app, const PlayOptions& options, bool takes_two_eyes = false);

// Throws Error(Usage) if the options contradict each other. `paths_follow`: the camera files are not known yet.
// `takes_two_eyes`: two eyes may be drawn, whatever --eyes says.
void checkRenderOptions(const CLI::App& app, const PlayOptions& options, bool paths_follow,
                        bool takes_two_eyes = false);

// Throws Error(Usage) if `option` was given but `has_effect` is false. `needs` names the options without which it has
// no effect, for the message.
void checkEffect(const CLI::App& app, const char* option, bool has_effect, const std::string& needs);

} // namespace gsc
