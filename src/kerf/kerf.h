// All that a program needs which cuts: scenes, sessions, meshes in and out, recordings, reports, haptics.
#pragma once

#include "kerf/mesh/mesh_file.h"
#include "kerf/record/recording.h"
#include "kerf/record/run_report.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/scene_file.h"
#include "kerf/session/haptics.h"
#include "kerf/session/session.h"
