/* SPDX-License-Identifier: MIT
 * jostle - animates groups of things: particles, flocks, rigid bodies, in one
 * entity-component-system. The whole core; scenes, telemetry and pictures have headers and
 * libraries of their own.
 */
#ifndef JOSTLE_JOSTLE_H
#define JOSTLE_JOSTLE_H

#include <jostle/base.h>
#include <jostle/body.h>
#include <jostle/components.h>
#include <jostle/ecs.h>
#include <jostle/flock.h>
#include <jostle/math.h>
#include <jostle/particle.h>
#include <jostle/shape.h>
#include <jostle/wind.h>
#include <jostle/world.h>

#endif
